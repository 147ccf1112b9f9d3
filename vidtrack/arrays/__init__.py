"""What arrays are in all parts: their types, maps of the plane, rows, and the checks of what users give."""
