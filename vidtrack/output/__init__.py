"""Sinks: what reads tracks and writes tables, pictures, plots and recordings. `sink.py` is their interface."""
