"""Slices of a long video: tracked apart, each after a warm-up, and stitched to the tracks of the whole."""
