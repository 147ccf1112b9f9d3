"""Pages over HTTP: the live page, for browsers and programs, and the one on which counts are looked at."""
