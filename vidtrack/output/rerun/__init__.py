"""Recordings of the tracker's inputs and decisions for the rerun viewer."""
