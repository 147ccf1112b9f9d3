"""Where the targets really are, and how much of them can be seen."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from vidtrack.arrays.types import Floats, Ints, Mask
from vidtrack.simulate.scene import Actor, Scene, bounds

RASTER = 4  # grid cells per scene pixel and axis when areas are counted


@dataclass(frozen=True, slots=True, eq=False)
class Truth:
    """One row a target and frame, in order of frame, then id; only targets with at least a scene pixel in the picture.

    frame       (N,) from 0
    time_s      (N,)
    id          (N,) 1, 2, ... in the order of `Scene.targets`
    box         (N, 4) left, top, width, height of the whole target, clipped to the picture, picture px
    visibility  (N,) share of the target's own area that is in the picture and behind nothing
    centre      (N, 2) centre of the whole target, also where that is outside the picture, picture px
    """

    frame: Ints
    time_s: Floats
    id: Ints
    box: Floats
    visibility: Floats
    centre: Floats

    def __len__(self) -> int:
        return len(self.frame)


def truth(scene: Scene, times: Floats, scale: Floats, shake: Floats) -> Truth:
    """The truth of frames at `times` (K,) for a camera with `scale` (2,) and `shake` (K, 2) in picture px."""
    moved = shake / scale
    whole = np.stack([bounds(actor.outline(times)) for actor in scene.targets]) + np.tile(moved, 2)
    clipped = np.clip(whole, 0, np.tile(scene.size, 2))
    row, frame = np.nonzero((clipped[..., 2:] - clipped[..., :2] >= 1).all(axis=-1))
    order = np.lexsort((row, frame))
    row, frame = row[order], frame[order]
    box, full = clipped[row, frame], whole[row, frame]
    return Truth(
        frame=frame,
        time_s=times[frame],
        id=row + 1,
        box=np.concatenate([box[:, :2], box[:, 2:] - box[:, :2]], axis=1) * np.tile(scale, 2),
        visibility=_visibility(scene, times, moved, row, frame),
        centre=(full[:, :2] + full[:, 2:]) / 2 * scale,
    )


def in_front(actors: tuple[Actor, ...], time: float) -> list[Actor]:
    """Actors from the farthest to the nearest: by layer, then by the lower edge in the picture."""
    at = np.array([time])
    return sorted(actors, key=lambda actor: (actor.layer, actor.outline(at)[0, :, 1].max()))


def _visibility(scene: Scene, times: Floats, moved: Floats, row: Ints, frame: Ints) -> Floats:
    """Visible share (N,) of targets `row` in frames `frame`."""
    share = np.ones(len(row))
    actors = scene.targets + scene.props
    boxes = np.stack([bounds(actor.outline(times)) for actor in actors])
    size = np.array(scene.size)
    for i, (r, k) in enumerate(zip(row, frame, strict=True)):
        box, others = boxes[r, k], boxes[:, k]
        meets = ((others[:, :2] < box[2:]) & (others[:, 2:] > box[:2])).all(axis=1)
        inside = (box[:2] + moved[k] >= 0).all() and (box[2:] + moved[k] <= size).all()
        if meets.sum() > 1 or not inside:
            near = tuple(actor for actor, met in zip(actors, meets, strict=True) if met)
            share[i] = _visible_share(scene.targets[r], near, times[k], size, moved[k])
    return share


def _visible_share(actor: Actor, near: tuple[Actor, ...], time: float, size: Ints, moved: Floats) -> float:
    """Area of the actor that is in the picture and not covered by nearer actors, over its whole area."""
    left, top, right, bottom = bounds(actor.outline(np.array([time])))[0]
    origin = np.array([left, top])
    shape = int(np.ceil((bottom - top) * RASTER)), int(np.ceil((right - left) * RASTER))
    mask = _silhouette(actor, time, origin, shape)
    total = np.count_nonzero(mask)
    order = in_front(near, time)
    for nearer in order[order.index(actor) + 1 :]:
        mask &= ~_silhouette(nearer, time, origin, shape)
    cell = np.stack(np.meshgrid(np.arange(shape[1]), np.arange(shape[0])), axis=-1) + 0.5
    at = origin + moved + cell / RASTER
    mask &= ((at >= 0) & (at <= size)).all(axis=-1)
    return np.count_nonzero(mask) / total


def _silhouette(actor: Actor, time: float, origin: Floats, shape: tuple[int, int]) -> Mask:
    """Which cells of a grid (`shape`, from `origin`) the actor's parts cover."""
    image = np.zeros(shape, np.uint8)
    for part in actor.look.parts:
        polygon = actor.place(part.polygon, np.array([time]))[0]
        cv2.fillPoly(image, [np.rint(((polygon - origin) * RASTER - 0.5) * 64).astype(np.int32)], (1,), cv2.LINE_8, 6)
    return image > 0
