"""Radar plots become scans: plot tables, coordinates, measurement models."""
