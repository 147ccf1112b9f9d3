"""The tracker and its policies. Read `tracker.py` first."""
