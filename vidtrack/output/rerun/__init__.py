"""What the tracker sees and decides, in rerun."""
