"""The user's mask: the region of the picture in which traffic is detected."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np

from vidtrack.errors import ConfigError
from vidtrack.video.frame import Image


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
