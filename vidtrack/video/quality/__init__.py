"""Quality of a source, measured from its pictures: timing, light, noise, shake, compression."""
