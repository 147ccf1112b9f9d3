"""How vehicles, people and leaves look from a high camera: polygons in the actor's own frame."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.random import Generator

from vidtrack.arrays.types import Floats
from vidtrack.simulate.scene import Colour, Look, Part

GLASS: Colour = (62, 54, 46)
TYRE: Colour = (34, 33, 32)
LAMP: Colour = (205, 240, 250)
TAIL_LAMP: Colour = (40, 35, 190)
CAR_COLOURS: tuple[Colour, ...] = (
    (232, 234, 235),  # white
    (188, 190, 190),  # silver
    (44, 40, 178),  # red
    (168, 92, 38),  # blue
    (52, 176, 224),  # yellow
    (26, 24, 24),  # black
    (66, 104, 34),  # green
    (62, 92, 170),  # copper
)
CLOTHES: tuple[Colour, ...] = ((190, 110, 40), (40, 40, 185), (215, 215, 220), (60, 165, 210), (130, 50, 120))
SKIN: tuple[Colour, ...] = ((140, 170, 215), (90, 120, 170), (60, 80, 125))


def car(length: float, width: float, colour: Colour) -> Look:
    """A saloon: bonnet, windscreen, roof, rear window, boot."""
    x, y = length / 2, width / 2
    return _solid(
        (
            Part(_rounded(-x, -y, x, y, 0.28 * width), _shade(colour, 0.82)),
            Part(_rounded(-0.97 * x, -0.8 * y, 0.97 * x, 0.8 * y, 0.25 * width), colour),
            Part(_taper(0.56 * x, 0.86 * y, 0.20 * x, 0.74 * y), GLASS),
            Part(_taper(-0.74 * x, 0.80 * y, -0.42 * x, 0.72 * y), GLASS),
            Part(_box(-0.50 * x, -0.84 * y, 0.24 * x, -0.74 * y), GLASS),
            Part(_box(-0.50 * x, 0.74 * y, 0.24 * x, 0.84 * y), GLASS),
            Part(_rounded(-0.46 * x, -0.70 * y, 0.22 * x, 0.70 * y, 0.12 * width), _shade(colour, 1.10)),
            *_lamps(x, y),
        ),
        height=0.6 * width,
        lamps=(0.9 * x, 0.62 * y),
    )


def lorry(length: float, width: float, cab: Colour, load: Colour) -> Look:
    """A box lorry: a cab, a gap, and a load with ribs."""
    x, y = length / 2, width / 2
    ribs = [
        Part(_box(r * x, -0.92 * y, (r + 0.025) * x, 0.92 * y), _shade(load, 0.86)) for r in np.arange(-0.8, 0.4, 0.2)
    ]
    return _solid(
        (
            Part(_box(-x, -y, 0.5 * x, y), load),
            *ribs,
            Part(_box(0.48 * x, -0.6 * y, 0.6 * x, 0.6 * y), TYRE),
            Part(_rounded(0.56 * x, -0.94 * y, x, 0.94 * y, 0.15 * width), cab),
            Part(_taper(0.93 * x, 0.85 * y, 0.80 * x, 0.75 * y), GLASS),
            *_lamps(x, y)[:2],
        ),
        height=0.8 * width,
        lamps=(0.9 * x, 0.62 * y),
    )


def motorcycle(length: float, width: float, paint: Colour, jacket: Colour) -> Look:
    """A motorcycle with its rider."""
    x, y = length / 2, width / 2
    return _solid(
        (
            Part(_rounded(-x, -0.3 * y, x, 0.3 * y, 0.2 * width), TYRE),
            Part(_rounded(-0.6 * x, -0.42 * y, 0.62 * x, 0.42 * y, 0.2 * width), paint),
            Part(_box(0.42 * x, -0.9 * y, 0.54 * x, 0.9 * y), TYRE),
            Part(_ellipse(-0.1 * x, 0, 0.36 * x, y), jacket),
            Part(_ellipse(0.12 * x, 0, 0.24 * x, 0.46 * y), (225, 225, 230)),
        ),
        height=0.9 * width,
        lamps=(0.9 * x, 0.0),
    )


def person(width: float, height: float, top: Colour, trousers: Colour, skin: Colour) -> Look:
    """Somebody walking, seen from the side; the origin is between the feet."""
    x = width / 2
    parts = (
        Part(np.array([(-0.55 * x, -0.48 * height), (0.2 * x, -0.48 * height), (-0.5 * x, 0.0), (-x, 0.0)]), trousers),
        Part(np.array([(-0.2 * x, -0.48 * height), (0.55 * x, -0.48 * height), (x, 0.0), (0.5 * x, 0.0)]), trousers),
        Part(_rounded(-0.9 * x, -0.84 * height, 0.9 * x, -0.42 * height, 0.3 * width), top),
        Part(_ellipse(0, -0.88 * height, 0.55 * x, 0.12 * height), skin),
        Part(_ellipse(-0.08 * x, -0.92 * height, 0.5 * x, 0.08 * height), TYRE),
    )
    base = _ellipse(0, -0.3, x, 0.3 * x)
    return Look(parts, _hull(parts), base, height, upright=True)


def foliage(radius: float, rng: Generator) -> Look:
    """A clump of leaves, light and dark."""
    leaves = []
    for light in np.linspace(0.75, 1.3, 26):
        r, angle = radius * np.sqrt(rng.uniform(0, 0.8)), rng.uniform(0, 2 * np.pi)
        size = radius * rng.uniform(0.16, 0.3)
        green = _shade((38, 92 + 12 * rng.uniform(-1, 1), 62), float(light))
        leaves.append(Part(_ellipse(r * np.cos(angle), r * np.sin(angle), size, 0.8 * size), green))
    parts = (Part(_ellipse(0, 0, 0.85 * radius, 0.8 * radius), (30, 66, 46)), *leaves)
    return Look(parts, _hull(parts), _ellipse(0, radius, radius, 0.6 * radius), radius, upright=True)


def _solid(parts: tuple[Part, ...], height: float, lamps: tuple[float, float]) -> Look:
    """A vehicle; `lamps` is the place of a headlamp, mirrored to the other side and to the rear."""
    outline, (x, y) = _hull(parts), lamps
    sides = (-y, y) if y else (y,)
    ahead, behind = tuple((x, side) for side in sides), tuple((-x, side) for side in sides)
    return Look(parts, outline, outline, height, headlamps=ahead, tail_lamps=behind)


def _lamps(x: float, y: float) -> tuple[Part, Part, Part, Part]:
    front, rear = (0.86 * x, 0.95 * x), (-0.97 * x, -0.92 * x)
    return (
        Part(_box(front[0], -0.80 * y, front[1], -0.45 * y), LAMP),
        Part(_box(front[0], 0.45 * y, front[1], 0.80 * y), LAMP),
        Part(_box(rear[0], -0.80 * y, rear[1], -0.45 * y), TAIL_LAMP),
        Part(_box(rear[0], 0.45 * y, rear[1], 0.80 * y), TAIL_LAMP),
    )


def _hull(parts: tuple[Part, ...]) -> Floats:
    points = np.concatenate([part.polygon for part in parts]).astype(np.float32)
    return cv2.convexHull(points)[:, 0].astype(float)


def _shade(colour: Colour, factor: float) -> Colour:
    blue, green, red = (min(255.0, factor * level) for level in colour)
    return blue, green, red


def _box(left: float, top: float, right: float, bottom: float) -> Floats:
    return np.array([(left, top), (right, top), (right, bottom), (left, bottom)])


def _taper(x0: float, y0: float, x1: float, y1: float) -> Floats:
    """A trapezoid across the vehicle: from -y0 to y0 at x0, from -y1 to y1 at x1."""
    return np.array([(x0, -y0), (x0, y0), (x1, y1), (x1, -y1)])


def _rounded(left: float, top: float, right: float, bottom: float, radius: float) -> Floats:
    """A rectangle with corners rounded by three edges each."""
    angle = np.radians([0, 30, 60, 90])
    arc = radius * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    quarter_turn = np.array([[0, 1], [-1, 0]])
    arcs = []
    for corner in np.array([(right, bottom), (left, bottom), (left, top), (right, top)]):
        arcs.append(corner + arc - radius * np.sign(arc.sum(axis=0)))
        arc = arc @ quarter_turn
    return np.concatenate(arcs)


def _ellipse(x: float, y: float, rx: float, ry: float) -> Floats:
    angle = np.linspace(0, 2 * np.pi, 17)[:-1]
    return np.stack([x + rx * np.cos(angle), y + ry * np.sin(angle)], axis=-1)
