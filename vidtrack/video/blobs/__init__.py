"""Blobs: regions of the foreground, each of one vehicle. Read `explain.py` first."""
