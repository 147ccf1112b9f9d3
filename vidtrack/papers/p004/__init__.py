"""Paper 004: Lee and Cheon, target tracking using confidence region in multi-target tracking (1999)."""
