"""Measures a source before it is tracked, and advises on settings."""
