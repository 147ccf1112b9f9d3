"""Occlusion: tracks of several targets that share one measurement."""
