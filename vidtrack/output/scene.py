"""scene.jpg: the learnt background of a run, the place without its traffic."""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path

import cv2
import numpy as np

from vidtrack.errors import ConfigError
from vidtrack.output.folder import replacing
from vidtrack.traffic.site import Site
from vidtrack.video.frame import Image

SCENE = "scene.jpg"


def write_scene(folder: Path, picture: Image) -> None:
    """Write scene.jpg, in place of the one that is there."""
    with replacing(folder / SCENE) as new:
        new.write_bytes(jpeg(picture))


def newest_scene(runs: Iterable[Path], site: Site) -> Image | None:
    """(H, W, 3) the scene of the last of these runs, in order of time, that has one which the site fits; or None."""
    for run in reversed(list(runs)):
        if not (run / SCENE).is_file():
            continue
        picture = cv2.imread(str(run / SCENE))
        if picture is None:  # damaged
            continue
        with suppress(ConfigError):
            site.scaled(picture.shape[1], picture.shape[0])  # refuses a picture of another shape
            return np.asarray(picture, np.uint8)
    return None


def jpeg(picture: Image, quality: int = 92) -> bytes:
    """A picture (H, W, 3) as JPEG."""
    return cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, quality])[1].tobytes()
