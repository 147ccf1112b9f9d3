"""From foreground to blobs that are one vehicle each. Read `explain.py` first."""
