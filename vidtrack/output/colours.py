"""Colours of track ids, the same in all outputs."""

from __future__ import annotations

import colorsys
from functools import cache

Colour = tuple[int, ...]


def colour(track_id: int) -> Colour:
    """Blue, green, red of a track id; consecutive ids differ strongly in hue."""
    return _hue(track_id % 256)


@cache
def _hue(step: int) -> Colour:
    red, green, blue = colorsys.hsv_to_rgb(step * 0.618034 % 1.0, 0.75 if step % 2 else 0.95, 1.0)
    return round(255 * blue), round(255 * green), round(255 * red)
