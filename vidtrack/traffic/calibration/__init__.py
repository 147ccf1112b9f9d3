"""From the points of a site to its road plane and camera, with their errors. Read `calibrate.py` first."""
