"""The papers' figures and tables, ours beside theirs: one module an experiment, listed in `registry`."""
