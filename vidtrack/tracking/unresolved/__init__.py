"""Unresolved targets: tracks of several point targets that share one measurement."""
