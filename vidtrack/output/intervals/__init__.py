"""Counts of a running camera by interval, in files by day that only their own limit removes. Read `book.py` first."""
