"""The tracker and its parts. Read `tracker.py` first."""
