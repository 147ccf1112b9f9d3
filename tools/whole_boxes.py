"""Boxes of CDnet's truth that hold the whole vehicle: its sure pixels, and those that the masks call unknown.

The identities of CDnet traffic have boxes around the sure pixels alone (255), and end while some are left. Unknown
pixels (170) are the blurred rim and what is below a vehicle, up to 15 rows of one that is 25 rows high.
"""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from vidtrack.formats import Table, box_table

UNKNOWN, SURE = 170, 255


def whole(truth: Table, masks: Path, last: int) -> Table:
    """The truth with boxes of connected sure and unknown pixels, up to the picture `last` that has sure ones.

    masks   folder of gt%06d.png, whose number is that of the frame, counted from 0, and 1
    """
    rows: list[tuple[int, int, NDArray]] = []
    for one in np.unique(truth.id):
        track = truth.select(truth.id == one)
        assert track.box is not None  # or it has no boxes to widen
        frames, boxes = list(track.frame), list(track.box)
        for frame, box in zip(frames, boxes, strict=True):
            rows.append((frame, one, region(box, masks, frame, sure=False)))
        frame, box = frames[-1] + 1, rows[-1][2]
        while frame < last and (box := region(box, masks, frame, sure=True)) is not None:
            rows.append((frame, one, box))
            frame += 1
    frames, ids, boxes = zip(*sorted(rows, key=lambda row: row[:2]), strict=True)
    return box_table(np.array(frames), np.array(ids), np.array(boxes))


def region(box: NDArray, masks: Path, frame: int, *, sure: bool) -> NDArray | None:
    """The box of the connected pixels that has most in common with `box`; None without one, or without a sure pixel."""
    mask = cv2.imread(str(masks / f"gt{frame + 1:06d}.png"), cv2.IMREAD_GRAYSCALE)
    assert mask is not None  # the data has all of them
    _, labels, stats, _ = cv2.connectedComponentsWithStats((mask >= UNKNOWN).astype(np.uint8))
    edges = np.column_stack([stats[:, :2], stats[:, :2] + stats[:, 2:4]])
    common = np.clip(np.minimum(edges[:, 2:], box[:2] + box[2:]) - np.maximum(edges[:, :2], box[:2]), 0, None).prod(1)
    common[0] = 0  # the background
    best = int(np.argmax(common))
    if common[best] == 0 or (sure and not (mask[labels == best] == SURE).any()):
        return None
    return stats[best, :4].astype(float)
