"""Many files on many cores: sources become tasks, an engine does them, results and the index of all go to one place."""
