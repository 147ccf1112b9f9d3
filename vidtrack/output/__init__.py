"""Sinks: they receive tracks and write tables, pictures, plots and recordings. `sink.py` is their interface."""
