"""scene.jpg: the learnt background of a run, the place without its traffic."""

from __future__ import annotations

import cv2

from vidtrack.video.frame import Image

SCENE = "scene.jpg"


def jpeg(picture: Image, quality: int = 92) -> bytes:
    """A picture (H, W, 3) as JPEG."""
    return cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, quality])[1].tobytes()
