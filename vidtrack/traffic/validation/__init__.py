"""Counts against a count by hand, event by event. Read `validate.py` first."""
