"""Amplitudes: densities, CFAR, information reduction, optimal detection thresholds."""
