"""Runs: each connects a source, a tracker and sinks, and writes a folder of results. Read `run/run.py` first."""
