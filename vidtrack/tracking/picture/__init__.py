"""What only a picture tells: boxes, the border, and what traffic teaches about the road."""
