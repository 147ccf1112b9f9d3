"""A scene as plain data: flat coloured polygons that move along known paths over a flat coloured ground.

Scene coordinates are the pixels of the scene's own size, x to the right, y down, and the corner of the
picture is (0, 0): pixel k covers k..k+1. Times are seconds, headings radians, 0 to the right, pi/2 down.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vidtrack.arrays.types import Floats, Mask

Colour = tuple[float, float, float]


@dataclass(frozen=True, slots=True, eq=False)
class Part:
    """A filled polygon (V, 2) of one BGR colour; `grain` is the standard deviation of its texture in grey levels."""

    polygon: Floats
    colour: Colour
    grain: float = 0.0


@dataclass(frozen=True, slots=True, eq=False)
class Look:
    """What an actor looks like, in its own frame: x forwards, y to its right, the origin where its path is.

    parts    painted in this order
    outline  (V, 2) convex hull of the parts
    base     (V, 2) convex polygon that stands on the ground
    height   px; how far the shadow reaches
    upright  seen from the side, never turned into the heading (people, trees)
    headlamps, tail_lamps  where they are; only vehicles have some
    """

    parts: tuple[Part, ...]
    outline: Floats
    base: Floats
    height: float
    upright: bool = False
    headlamps: tuple[tuple[float, float], ...] = ()
    tail_lamps: tuple[tuple[float, float], ...] = ()


@dataclass(frozen=True, slots=True, eq=False)
class Path:
    """Poses at knots t (K,) [s]: xy (K, 2), heading (K,) unwrapped; linear between, standing before and after."""

    t: Floats
    xy: Floats
    heading: Floats

    def at(self, times: Floats) -> tuple[Floats, Floats]:
        """Positions (N, 2) and headings (N,) at `times` (N,)."""
        xy = np.stack([np.interp(times, self.t, self.xy[:, axis]) for axis in (0, 1)], axis=-1)
        return xy, np.interp(times, self.t, self.heading)


@dataclass(frozen=True, slots=True, eq=False)
class Actor:
    """Something that moves. `layer` decides what is in front, then the lower edge in the picture."""

    name: str
    look: Look
    path: Path
    layer: int = 0

    def place(self, polygon: Floats, times: Floats) -> Floats:
        """A polygon (V, 2) of the actor's own frame in scene coordinates, (N, V, 2)."""
        xy, heading = self.path.at(times)
        if self.look.upright:
            return xy[:, None] + polygon
        c, s = np.cos(heading), np.sin(heading)
        turn = np.stack([np.stack([c, s], -1), np.stack([-s, c], -1)], axis=1)  # rows: images of the two axes
        return xy[:, None] + polygon @ turn

    def outline(self, times: Floats) -> Floats:
        """(N, V, 2) convex outline in scene coordinates."""
        return self.place(self.look.outline, times)


@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """Everything there is to draw.

    size     (width, height) px
    fps      frames/s at which the scene is shown unless asked otherwise
    ground   painted in this order; the first covers everything
    targets  what a tracker should find; their ids are 1, 2, ... in this order
    props    what moves and is not a target
    sun      shadow's offset per pixel of height; None: overcast, no shadows
    """

    size: tuple[int, int]
    fps: float
    duration_s: float
    ground: tuple[Part, ...]
    targets: tuple[Actor, ...]
    props: tuple[Actor, ...] = ()
    sun: tuple[float, float] | None = None

    def times(self, fps: float | None = None) -> Floats:
        """Times of the frames (K,) [s]."""
        fps = self.fps if fps is None else fps
        return np.arange(max(1, round(self.duration_s * fps))) / fps


def bounds(polygons: Floats) -> Floats:
    """Boxes (..., 4) left, top, right, bottom of polygons (..., V, 2)."""
    return np.concatenate([polygons.min(axis=-2), polygons.max(axis=-2)], axis=-1)


def inside(boxes: Floats, size: tuple[int, int]) -> Mask:
    """Which boxes (..., 4) of left, top, right, bottom lie whole in a picture of `size` (width, height)."""
    return np.asarray((boxes[..., :2] >= 0).all(axis=-1) & (boxes[..., 2:] <= size).all(axis=-1))


def touching(a: Floats, b: Floats, margin: float = 0.0) -> Mask:
    """In which rows (N,) the convex polygons a (N, V, 2) and b (N, W, 2) overlap, or come closer than `margin`.

    By the separating axis theorem; with a margin, corners that face each other count a little early.
    """
    boxes = bounds(a), bounds(b)
    result = np.all(
        np.maximum(boxes[0][:, :2], boxes[1][:, :2]) <= np.minimum(boxes[0][:, 2:], boxes[1][:, 2:]) + margin, axis=1
    )
    result[result] = _gap(a[result], b[result]) <= margin
    return result


def _gap(a: Floats, b: Floats) -> Floats:
    """Largest separation (N,) along any edge's normal; negative when convex polygons overlap."""
    edges = np.concatenate([np.roll(a, -1, axis=1) - a, np.roll(b, -1, axis=1) - b], axis=1)
    normals = np.stack([edges[..., 1], -edges[..., 0]], axis=-1)
    normals /= np.maximum(np.linalg.norm(normals, axis=-1, keepdims=True), 1e-12)
    along_a = np.einsum("nec,nvc->nev", normals, a)
    along_b = np.einsum("nec,nvc->nev", normals, b)
    apart = np.maximum(along_a.min(-1) - along_b.max(-1), along_b.min(-1) - along_a.max(-1))
    return np.asarray(apart.max(axis=1))
