"""Group tracking of targets too close together for individual tracks."""
