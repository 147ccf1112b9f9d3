"""A date and time burnt into the picture, as recorders do."""

from __future__ import annotations

from datetime import datetime, timedelta

import cv2
import numpy as np

from vidtrack.simulate.draw import Image

FIRST = datetime(2024, 1, 1)
SECONDS = 366 * 24 * 3600


def beginning(seed: int) -> datetime:
    """When a clip began, drawn by its seed."""
    return FIRST + timedelta(seconds=int(np.random.default_rng((seed, 8)).integers(SECONDS)))


def burn_in(picture: Image, now: datetime) -> None:
    """Write the time to a tenth of a second, white with a dark rim."""
    text = now.strftime("%Y-%m-%d %H:%M:%S.%f")[:-5]
    height, width = picture.shape[:2]
    size = 0.55 * width / cv2.getTextSize(text, cv2.FONT_HERSHEY_SIMPLEX, 1.0, 1)[0][0]
    place = (round(0.02 * width), round(0.07 * height))
    line = max(1, round(width / 500))
    for colour, thickness in (((20, 20, 20), line + 2), ((240, 240, 240), line)):
        cv2.putText(picture, text, place, cv2.FONT_HERSHEY_SIMPLEX, size, colour, thickness, cv2.LINE_AA)
