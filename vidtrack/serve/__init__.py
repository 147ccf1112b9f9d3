"""The live page: what cameras see and how they fare, for a browser and for other programs, over HTTP."""
