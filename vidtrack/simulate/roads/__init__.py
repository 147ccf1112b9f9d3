"""Roads seen by a real camera: vehicles with height that follow, queue, yield and change lanes, with exact truth.

Metres on the ground: x east, y north, z up. Headings are radians from east to north.
"""
