"""Telling vehicles apart: what traffic teaches about a scene, and the one explanation of every blob that uses it."""
