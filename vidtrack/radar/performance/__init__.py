"""How well a radar will track: errors and probabilities by theory, and the Monte Carlo runs beside them."""
