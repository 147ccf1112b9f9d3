"""The detector's foreground masks, one 0/255 picture per frame."""

from __future__ import annotations

from pathlib import Path

import cv2

from vidtrack.errors import ConfigError, OutputError
from vidtrack.output.folder import replacing
from vidtrack.output.sink import Step


class MaskFolder:
    """Sink that writes `%06d.png` by frame number, at source size. Raises OutputError if the folder cannot be made."""

    def __init__(self, folder: Path) -> None:
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise OutputError(f"cannot make {folder}: {error.strerror}; give --save-masks another folder") from None
        self._folder = folder

    def step(self, step: Step) -> None:
        """Write the mask of one frame."""
        if step.frame is None or step.foreground is None:
            raise ConfigError("stored detections have no masks; leave --save-masks out")
        mask = step.foreground.full_size(step.frame.shape)
        with replacing(self._folder / f"{step.index:06d}.png") as new:
            # cv2.imwrite does not report the reason of a failure.
            new.write_bytes(cv2.imencode(".png", mask, [cv2.IMWRITE_PNG_BILEVEL, 1])[1].tobytes())

    def close(self) -> None:
        """Do nothing: each mask is already written."""
