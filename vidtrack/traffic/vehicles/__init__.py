"""What a whole track tells of its vehicle: the path on the road, the size, the class."""
