"""Groups of settings that `vidtrack.config` puts together."""
