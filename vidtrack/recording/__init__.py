"""What a live camera sent, kept on the disk: written beside the run, read as a source, pruned by age and size."""
