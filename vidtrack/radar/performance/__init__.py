"""Performance prediction for a radar tracker: theory and Monte Carlo runs."""
