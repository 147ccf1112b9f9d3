"""How strong a signal must be: amplitude densities, CFAR, information reduction, optimal detection thresholds."""
