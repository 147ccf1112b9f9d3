"""Several radars: where they are, their plots in one order of time, and their registration."""
