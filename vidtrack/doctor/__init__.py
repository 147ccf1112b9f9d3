"""Looks at a source before it is tracked, and says which setting will hurt."""
