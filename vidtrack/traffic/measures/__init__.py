"""Traffic figures of a site, from the tables of finished runs."""
