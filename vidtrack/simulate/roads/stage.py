"""The vehicles of one moment before the camera: who hides whom, their pictures and their shadows."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np

from vidtrack.arrays.types import Floats, Ints, Mask
from vidtrack.simulate.draw import Image
from vidtrack.simulate.roads.pinhole import NEAR_M, Pinhole
from vidtrack.simulate.roads.solids import Solid
from vidtrack.simulate.scene import bounds

SUBPIXEL_BITS = 5
BESIDE_PX = 400  # vehicles farther outside the picture are not drawn: their shadows do not reach it


@dataclass(frozen=True, eq=False)
class Actor:
    """A vehicle where it is: `shape` (F, C, 3) its faces in metres on the road, `picture` (F, C, 2) px."""

    row: int
    solid: Solid
    shape: Floats
    picture: Floats
    turn: Floats
    place: Floats

    @cached_property
    def box(self) -> Floats:
        """(4,) left, top, right, bottom of the whole vehicle, px."""
        return bounds(self.picture.reshape(-1, 2))

    @cached_property
    def silhouette(self) -> list[Floats]:
        """Convex polygons (V, 2) px that together are what the vehicle covers."""
        return [_hull(self.picture[self.solid.body == body].reshape(-1, 2)) for body in range(len(self.solid.bodies))]

    def shadow(self, sun: Floats) -> list[Floats]:
        """Convex polygons (V, 2) m on the ground: each body thrown along the sun's rays; `sun` (3,) points to it."""
        polygons = []
        for body in range(len(self.solid.bodies)):
            points = self.shape[self.solid.body == body].reshape(-1, 3)
            polygons.append(_hull(points[:, :2] - points[:, 2:] * sun[:2] / sun[2]))
        return polygons

    def mirrored(self, camera: Pinhole) -> list[Floats]:
        """The silhouette as a wet road mirrors it, px."""
        xy = camera.project(self.shape * [1, 1, -1])[0]
        return [_hull(xy[self.solid.body == body].reshape(-1, 2)) for body in range(len(self.solid.bodies))]


def footprints(xy: Floats, heading: Floats, length: Floats, width: Floats) -> Floats:
    """(N, 4, 2) rectangles on the ground, counter-clockwise from the front left corner."""
    ahead = np.column_stack([np.cos(heading), np.sin(heading)]) * length[:, None] / 2
    left = np.column_stack([-np.sin(heading), np.cos(heading)]) * width[:, None] / 2
    return xy[:, None] + np.stack([ahead + left, left - ahead, -ahead - left, ahead - left], axis=1)


def stage(solids: list[Solid], xy: Floats, heading: Floats, camera: Pinhole, size: tuple[int, int]) -> list[Actor]:
    """The vehicles (N,) that the camera may see, in their order."""
    actors = []
    for row, solid in enumerate(solids):
        c, s = np.cos(heading[row]), np.sin(heading[row])
        turn = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])  # rows: the vehicle's axes
        place = np.array([*xy[row], 0.0])
        if (place - camera.position) @ camera.axes[2] < -10:
            continue
        shape = solid.polygons @ turn + place
        picture, depth = camera.project(shape)
        actor = Actor(row, solid, shape, picture, turn, place)
        near = (actor.box[:2] < np.array(size) + BESIDE_PX).all() and (actor.box[2:] > -BESIDE_PX).all()
        if depth.min() > NEAR_M and near:
            actors.append(actor)
    return actors


def painted(actors: list[Actor], footprint: Floats, eye: Floats) -> list[Actor]:
    """The actors from the farthest to the nearest; `footprint` (N, 4, 2) of all rows, `eye` (2,) the camera's place."""
    if not actors:
        return []
    base = footprint[[actor.row for actor in actors]]
    box = np.stack([actor.box for actor in actors])
    meet = ((box[:, None, :2] < box[None, :, 2:]) & (box[:, None, 2:] > box[None, :, :2])).all(axis=2)
    hides = nearer(base, eye) & meet
    far = np.linalg.norm(base.mean(axis=1) - eye, axis=1)
    left, order = np.ones(len(actors), bool), []
    while left.any():
        ready = left & ~(hides & left[None]).any(axis=1)
        ready = ready if ready.any() else left
        order.append(int(np.where(ready, far, -1).argmax()))
        left[order[-1]] = False
    return [actors[k] for k in order]


def nearer(base: Floats, eye: Floats) -> Mask:
    """(N, N) whether convex footprint i (N, 4, 2) can hide j and not the reverse.

    A line that separates two footprints has the eye on one side: what stands there may hide the other one.
    """
    edge = np.roll(base, -1, axis=1) - base
    normal = np.stack([edge[..., 1], -edge[..., 0]], axis=-1)
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    own = np.einsum("iec,ivc->iev", normal, base).max(axis=2)
    other = np.einsum("iec,jvc->ijev", normal, base).min(axis=3)
    gap = other - own[:, None]
    best = gap.argmax(axis=2)
    middle = np.take_along_axis(own[:, None] + gap / 2, best[..., None], axis=2)[..., 0]
    eye_side = np.einsum("iec,c->ie", normal, eye)
    on_own_side = np.take_along_axis(np.broadcast_to(eye_side[:, None], gap.shape), best[..., None], axis=2)[..., 0]
    mine, theirs = on_own_side < middle, gap.max(axis=2)
    result = np.where(theirs >= theirs.T, mine, ~mine.T)
    np.fill_diagonal(result, False)
    return np.asarray(result, bool)


def draw(canvas: Image, actor: Actor, camera: Pinhole, sun: Floats | None) -> None:
    """Paint a vehicle's faces; `sun` (3,) points to it, None: overcast."""
    solid = actor.solid
    eye = actor.turn @ (camera.position - actor.place)
    faced = np.einsum("fc,fc->f", solid.normals, eye - solid.polygons[:, 0]) > 0
    if sun is None:
        light = 0.76 + 0.2 * solid.normals[:, 2]
    else:
        light = 0.66 + 0.42 * np.maximum(solid.normals @ (actor.turn @ sun), 0)
    colour = np.clip(solid.colours * np.where(solid.glows, 1, light)[:, None], 0, 255)
    fixed = _fixed(actor.picture)
    for body in dict.fromkeys(solid.body[solid.order(float(eye[0]))].tolist()):
        faces = np.flatnonzero((solid.body == body) & faced)
        if len(faces) == 0:
            continue
        cv2.fillConvexPoly(
            canvas, _fixed(actor.silhouette[body]), colour[faces[0]].tolist(), cv2.LINE_AA, SUBPIXEL_BITS
        )
        for face in faces:
            cv2.fillConvexPoly(canvas, fixed[face], colour[face].tolist(), cv2.LINE_AA, SUBPIXEL_BITS)


def fill(mask: Image, polygon: Floats, level: float = 255) -> None:
    """Fill a convex polygon (V, 2) px of a mask."""
    cv2.fillConvexPoly(mask, _fixed(polygon), (level,), cv2.LINE_AA, SUBPIXEL_BITS)


def _fixed(polygon: Floats) -> Ints:
    return np.rint((polygon - 0.5) * 2**SUBPIXEL_BITS).astype(np.int32)


def _hull(points: Floats) -> Floats:
    return cv2.convexHull(points.astype(np.float32))[:, 0].astype(float)
