"""Vehicles as convex bodies with painted faces, in their own frame (x forwards, y left, z up), metres."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays.types import Floats, Ints
from vidtrack.simulate.looks import CLOTHES, GLASS, LAMP, TAIL_LAMP, TYRE
from vidtrack.simulate.roads.vehicles import KINDS, Fleet
from vidtrack.simulate.scene import Colour

CORNERS = 8  # of every face; those with fewer repeat their last one
LOAD: Colour = (196, 200, 202)
UNDERNEATH: Colour = (26, 26, 27)


@dataclass(frozen=True, slots=True, eq=False)
class Face:
    """A flat convex polygon (CORNERS, 3), counter-clockwise from outside."""

    polygon: Floats
    colour: Colour
    glows: bool = False


@dataclass(frozen=True, eq=False)
class Solid:
    """A vehicle as convex bodies, each a list of faces; nearer bodies are painted later.

    bodies  stacked from below, or in line from the rear to the front
    split   m; x between bodies in line; None: they are stacked
    headlamps, tail_lamps  (n, 3) m
    """

    bodies: tuple[tuple[Face, ...], ...]
    split: float | None
    headlamps: Floats
    tail_lamps: Floats

    @cached_property
    def polygons(self) -> Floats:
        """(F, CORNERS, 3) of all faces."""
        return np.stack([face.polygon for body in self.bodies for face in body])

    @cached_property
    def normals(self) -> Floats:
        """(F, 3) unit vectors outwards."""
        p = self.polygons
        normal = np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 1])
        return np.asarray(normal / np.linalg.norm(normal, axis=1, keepdims=True))

    @cached_property
    def colours(self) -> Floats:
        """(F, 3) BGR."""
        return np.array([face.colour for body in self.bodies for face in body])

    @cached_property
    def glows(self) -> NDArray[np.bool_]:
        """(F,) faces that are bright by themselves."""
        return np.array([face.glows for body in self.bodies for face in body])

    @cached_property
    def body(self) -> Ints:
        """(F,) body of each face."""
        return np.repeat(np.arange(len(self.bodies)), [len(body) for body in self.bodies])

    def order(self, camera_x: float) -> Ints:
        """Faces in the order in which they are painted, for a camera at x in the vehicle's frame."""
        if self.split is None or camera_x >= self.split:
            return np.arange(len(self.body))
        return np.argsort(-self.body, kind="stable")


def solid(fleet: Fleet, vehicle: int) -> Solid:
    """The look of one vehicle."""
    kind = KINDS[fleet.kind[vehicle]].name
    size = float(fleet.length[vehicle]), float(fleet.width[vehicle]), float(fleet.height[vehicle])
    blue, green, red = (float(level) for level in fleet.colour[vehicle])
    return _MAKERS[kind](*size, (blue, green, red))


def _car(length: float, width: float, height: float, paint: Colour) -> Solid:
    x, y, waist = length / 2, width / 2, 0.56 * height
    lower = _box((-x, x), y, (0.2, waist), (-0.97 * x, 0.93 * x), 0.94 * y, paint)
    lower += _lamps(lower, 0.55, 0.8) + _wheels((-0.6 * x, 0.6 * x), y, 0.31)
    cabin = _box((-0.86 * x, 0.42 * x), 0.9 * y, (waist, height), (-0.58 * x, 0.06 * x), 0.72 * y, paint)
    cabin += _panes(cabin, {"front": (0.06, 0.94, 0.05, 0.92), "rear": (0.08, 0.92, 0.1, 0.9)})
    cabin += _panes(cabin, dict.fromkeys(("left", "right"), (0.06, 0.47, 0.1, 0.85)))
    cabin += _panes(cabin, dict.fromkeys(("left", "right"), (0.53, 0.94, 0.1, 0.85)))
    return _vehicle(((*_underneath(-x, x, y), *lower), tuple(cabin)), None, x, y, 0.6)


def _van(length: float, width: float, height: float, paint: Colour) -> Solid:
    x, y, waist = length / 2, width / 2, 0.5 * height
    lower = _box((-x, x), y, (0.25, waist), (-x, 0.9 * x), 0.98 * y, paint)
    lower += _lamps(lower, 0.45, 0.7) + _wheels((-0.62 * x, 0.62 * x), y, 0.35)
    upper = _box((-x, 0.9 * x), 0.98 * y, (waist, height), (-0.98 * x, 0.56 * x), 0.88 * y, paint)
    upper += _panes(upper, {"front": (0.06, 0.94, 0.05, 0.85), "rear": (0.1, 0.9, 0.25, 0.85)})
    upper += _panes(upper, {"left": (0.05, 0.26, 0.05, 0.7), "right": (0.74, 0.95, 0.05, 0.7)})
    return _vehicle(((*_underneath(-x, x, y), *lower), tuple(upper)), None, x, y, 0.7)


def _lorry(length: float, width: float, height: float, paint: Colour) -> Solid:
    x, y = length / 2, width / 2
    split = x - 2.1
    load = _box((-x, split - 0.1), y, (0.55, height), (-x, split - 0.1), y, LOAD)
    load += _panes(load, dict.fromkeys(("left", "right"), (0.0, 1.0, 0.0, 0.1)), (110, 112, 114))
    load += _lamps(load, 0.02, 0.07)[1::2] + _wheels((-0.72 * x, -0.4 * x), y, 0.48)
    low = 0.78 * height
    cab = _box((split, x), 0.98 * y, (0.45, low), (split, x - 0.18), 0.94 * y, paint)
    cab += _panes(cab, {"front": (0.06, 0.94, 0.5, 0.92)})
    cab += _panes(cab, {"left": (0.1, 0.65, 0.5, 0.88), "right": (0.35, 0.9, 0.5, 0.88)})
    cab += _lamps(cab, 0.08, 0.2)[0::2] + _wheels((x - 1.2,), 0.98 * y, 0.48)
    return _vehicle(((*_underneath(-x, split, y), *load), (*_underneath(split, x, y), *cab)), split - 0.05, x, y, 0.8)


def _bus(length: float, width: float, height: float, paint: Colour) -> Solid:
    x, y = length / 2, width / 2
    body = _box((-x, x), y, (0.3, height), (-x, x - 0.1), 0.97 * y, paint)
    body += _panes(body, {"front": (0.05, 0.95, 0.35, 0.85), "rear": (0.12, 0.88, 0.5, 0.82)})
    for k in range(6):
        pane = (0.03 + 0.16 * k, 0.165 + 0.16 * k, 0.42, 0.82)
        body += _panes(body, {"left": pane, "right": pane})
    body += _panes(body, {"top": (0.3, 0.45, 0.3, 0.7)}, (150, 152, 154))
    body += _lamps(body, 0.1, 0.18) + _wheels((-0.5 * x, 0.6 * x), y, 0.48)
    return _vehicle(((*_underneath(-x, x, y), *body),), None, x, y, 0.8)


def _motorcycle(length: float, width: float, height: float, paint: Colour) -> Solid:
    x, y = length / 2, width / 2
    jacket = CLOTHES[int(sum(paint)) % len(CLOTHES)]
    machine = _box((-0.75 * x, 0.7 * x), 0.35 * y, (0.3, 0.62 * height), (-0.7 * x, 0.45 * x), 0.3 * y, paint)
    machine += _lamps(machine, 0.55, 0.9) + _wheels((-0.66 * x, 0.66 * x), 0.36 * y, 0.31)
    bars = _box((0.34 * x, 0.46 * x), y, (0.58 * height, 0.64 * height), (0.34 * x, 0.46 * x), y, TYRE)
    rider = _box((-0.4 * x, 0.12 * x), 0.6 * y, (0.5 * height, 0.86 * height), (-0.2 * x, 0.2 * x), 0.55 * y, jacket)
    head = _box(
        (-0.08 * x, 0.2 * x), 0.3 * y, (0.84 * height, height), (-0.05 * x, 0.16 * x), 0.24 * y, (215, 215, 220)
    )
    under = _underneath(-0.8 * x, 0.8 * x, 0.5 * y)
    return _vehicle(((*under, *machine), tuple(bars), tuple(rider), tuple(head)), None, x, 0.0, 0.8)


_MAKERS = {"car": _car, "van": _van, "lorry": _lorry, "bus": _bus, "motorcycle": _motorcycle}
_SIDES = ("front", "left", "rear", "right", "top")


def _vehicle(bodies: tuple[tuple[Face, ...], ...], split: float | None, x: float, y: float, lamp: float) -> Solid:
    sides = (-0.75 * y, 0.75 * y) if y else (0.0,)
    return Solid(bodies, split, *(np.array([(end, side, lamp) for side in sides]) for end in (x, -x)))


def _box(
    bottom: tuple[float, float], y: float, z: tuple[float, float], top: tuple[float, float], y_top: float, paint: Colour
) -> list[Face]:
    """A box whose rectangle at z[1] may be smaller: front, left, rear, right, top."""
    (rear, front), (low, high), (rear_top, front_top) = bottom, z, top
    a = np.array([(front, -y, low), (front, y, low), (rear, y, low), (rear, -y, low)])
    b = np.array(
        [(front_top, -y_top, high), (front_top, y_top, high), (rear_top, y_top, high), (rear_top, -y_top, high)]
    )
    sides = [np.stack([a[k], a[(k + 1) % 4], b[(k + 1) % 4], b[k]]) for k in range(4)]
    return [_face(polygon, paint) for polygon in (*sides, b)]


def _face(polygon: Floats, colour: Colour, glows: bool = False) -> Face:
    return Face(np.concatenate([polygon, np.repeat(polygon[-1:], CORNERS - len(polygon), axis=0)]), colour, glows)


def _part(face: Face, u0: float, u1: float, v0: float, v1: float) -> Floats:
    """A share of a face with four corners: u along its lower edge, v upwards."""
    p = face.polygon[:4]
    return np.stack([(1 - v) * ((1 - u) * p[0] + u * p[1]) + v * ((1 - u) * p[3] + u * p[2])
                     for u, v in ((u0, v0), (u1, v0), (u1, v1), (u0, v1))])  # fmt: skip


def _panes(box: list[Face], where: dict[str, tuple[float, float, float, float]], colour: Colour = GLASS) -> list[Face]:
    """Parts of a box's sides in another colour."""
    return [_face(_part(box[_SIDES.index(side)], *share), colour) for side, share in where.items()]


def _lamps(box: list[Face], low: float, high: float) -> list[Face]:
    """Lamps at both ends of a box: front, rear, front, rear."""
    return [
        _face(_part(box[_SIDES.index(side)], u, u + 0.2, low, high), colour, glows=True)
        for u in (0.05, 0.75)
        for side, colour in (("front", LAMP), ("rear", TAIL_LAMP))
    ]


def _wheels(at: tuple[float, ...], y: float, radius: float) -> list[Face]:
    """Wheels on both sides, as they are seen from outside."""
    angle = np.linspace(0, 2 * np.pi, CORNERS + 1)[:-1]
    round_x, round_z = radius * np.cos(angle), radius * (1 + np.sin(angle))
    left = [np.column_stack([x - round_x, np.full(CORNERS, y), round_z]) for x in at]
    right = [np.column_stack([x + round_x, np.full(CORNERS, -y), round_z]) for x in at]
    return [_face(polygon, TYRE) for polygon in left + right]


def _underneath(rear: float, front: float, y: float) -> list[Face]:
    """The dark ground below a vehicle."""
    rear, front, y = 0.96 * rear, 0.96 * front, 0.94 * y
    return [_face(np.array([(front, -y, 0.0), (front, y, 0.0), (rear, y, 0.0), (rear, -y, 0.0)]), UNDERNEATH)]
