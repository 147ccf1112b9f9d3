"""Reproduction of the papers' figures and tables: one module per experiment, listed in `registry`."""
