"""Arrays: their types, affine maps, sorted rows, and checks of user input."""
