"""All settings: their groups and defaults (`settings.py` first), and how they are read (`load.py`)."""
