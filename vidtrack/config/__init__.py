"""All settings: groups and defaults (read `settings.py` first), and their reader (`load.py`)."""
