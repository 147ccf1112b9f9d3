"""Which measurement belongs to which track: the gate, clusters, and one file an association rule."""
