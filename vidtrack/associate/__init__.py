"""Data association: the gate, clusters, and one file per association rule."""
