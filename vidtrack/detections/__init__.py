"""Stored detections: scans from a file of a detector's boxes, and the parameters of that detector."""
