"""The user's mask: the region of the picture in which traffic is detected."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np

from vidtrack.errors import ConfigError
from vidtrack.video.frame import Image

Corners = Sequence[tuple[float, float]]


def without(keep: Image | None, areas: Sequence[Corners], width: int, height: int) -> Image | None:
    """The mask without areas, given by their corners [px] in a picture of this size; None: everything is kept."""
    if not areas:
        return keep
    kept = np.full((height, width), 255, np.uint8) if keep is None else keep.copy()
    scale = np.array([kept.shape[1] / width, kept.shape[0] / height])
    for area in areas:
        cv2.fillPoly(kept, [np.rint((np.asarray(area) + 0.5) * scale - 0.5).astype(np.int32)], 0)
    return kept


def read_mask(path: Path) -> Image:
    """(H, W) mask, white where traffic is detected. Raises ConfigError if the file is not such a picture."""
    try:
        data = np.frombuffer(path.read_bytes(), np.uint8)
    except OSError as error:
        raise ConfigError(f"cannot read the mask {path}: {error.strerror}") from None
    mask = cv2.imdecode(data, cv2.IMREAD_GRAYSCALE) if len(data) else None
    if mask is None:
        raise ConfigError(f"cannot read the mask {path}; it must be a picture, white where traffic is looked for")
    if not (mask > 127).any():
        raise ConfigError(f"the mask {path} is black all over; it must be white where traffic is looked for")
    return np.asarray(mask, np.uint8)
