"""Everything between the command line and the stages: source, steps, sinks, folder. Read `run/run.py` first."""
