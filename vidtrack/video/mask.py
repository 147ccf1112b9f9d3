"""The user's mask: where in the picture traffic is looked for."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np

from vidtrack.errors import ConfigError
from vidtrack.video.frame import Image


def read_mask(path: Path) -> Image:
    """(H, W) picture that is white where traffic is looked for. Raises ConfigError if it is not a picture."""
    mask = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
    if mask is None:
        raise ConfigError(f"cannot read the mask {path}; it must be a picture, white where traffic is looked for")
    return np.asarray(mask, np.uint8)
