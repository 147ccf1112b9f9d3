"""Tracking in pictures: boxes, the border, and maps learnt from traffic."""
