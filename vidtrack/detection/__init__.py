"""When a radar says "there is something": amplitude densities, CFAR, information reduction, optimal thresholds."""
