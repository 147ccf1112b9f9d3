"""The live page: pictures, tracks and status of the cameras over HTTP, for browsers and programs."""
