"""The page on which a site is drawn over the tracks of a run, and saved."""
