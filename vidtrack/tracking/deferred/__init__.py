"""Decisions that wait for later scans: track splitting and multiple hypotheses."""
