"""Motion models of targets."""
