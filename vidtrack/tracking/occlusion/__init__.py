"""Several targets on one measurement: what their tracks take from it."""
