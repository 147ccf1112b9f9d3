"""Paper 003: Moon, target estimation filter based on a particle filter for the multi-function radar (2011)."""
