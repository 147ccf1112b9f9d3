"""What a source is like, measured from its pictures: time, light, noise, shake, compression."""
