"""scene.jpg: the learnt background of a run, the place without its traffic."""

from __future__ import annotations

from pathlib import Path

import cv2

from vidtrack.output.folder import replacing
from vidtrack.video.frame import Image

SCENE = "scene.jpg"


def write_scene(folder: Path, picture: Image) -> None:
    """Write scene.jpg, in place of the one that is there."""
    with replacing(folder / SCENE) as new:
        new.write_bytes(jpeg(picture))


def jpeg(picture: Image, quality: int = 92) -> bytes:
    """A picture (H, W, 3) as JPEG."""
    return cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, quality])[1].tobytes()
