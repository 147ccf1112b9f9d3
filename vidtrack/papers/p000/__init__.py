"""Paper 000: Jung and Shin, suboptimal detection thresholds for tracking in clutter (2002)."""
