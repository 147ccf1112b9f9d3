"""Warnings during tracking about pictures outside the tracker's limits."""

from __future__ import annotations

import numpy as np

from vidtrack.tracking.picture.road import Road
from vidtrack.video.background.picture import reduce
from vidtrack.video.foreground import Foreground
from vidtrack.video.frame import Frame

_EVERY_S = 1.0
_LASTS = 5  # looks in a row that make it worth saying
_DARK = 25.0  # luminance above black that 5 % of a picture exceed
_SMALL_PX = 8.0  # pixels of the mask; smaller vehicles are lost in the majority of a window
_RESTLESS = 0.3  # share of the picture's cells
_THIN = 8  # every so many pixels are looked at


class LimitChecks:
    """Checks once a second; a condition that lasts for five checks gives one warning."""

    def __init__(self) -> None:
        self._due_s = 0.0
        self._lasted = dict.fromkeys(("dark", "small", "restless"), 0)

    def look(self, frame: Frame, foreground: Foreground, road: Road | None) -> tuple[str, ...]:
        """New warnings at this frame."""
        if frame.time_s < self._due_s or road is None:
            return ()
        self._due_s = frame.time_s + _EVERY_S
        seen = {
            "dark": (_is_dark(frame, foreground.step), "the picture is nearly black; unlit vehicles are not seen"),
            "small": (
                _are_small(foreground, road),
                "vehicles are only a few pixels large; --scale 1 may show them better",
            ),
            "restless": (
                float(road.restless.now().mean()) > _RESTLESS,
                "most of what moves is no traffic (leaves, rain, water?); keep the road alone with --mask",
            ),
        }
        said = []
        for name, (now, what) in seen.items():
            self._lasted[name] = self._lasted[name] + 1 if now else 0 if self._lasted[name] < _LASTS else _LASTS + 1
            if self._lasted[name] == _LASTS:
                said.append(what)
        return tuple(said)


def _is_dark(frame: Frame, step: int) -> bool:
    """Whether a picture is nearly black, as it is after its reduction by step; it may be reduced already."""
    black, luma = 0 if frame.full_range else 16, reduce(frame, step).luma
    return float(np.percentile(luma[::_THIN, ::_THIN], 95)) - black < _DARK


def _are_small(foreground: Foreground, road: Road) -> bool:
    """Whether vehicles in the middle of the picture are too small."""
    if not road.sizes.known or foreground.step == 1:
        return False
    h, w = (size * foreground.step for size in foreground.mask.shape)
    typical = road.sizes.typical(np.array([[w / 2, h / 2, 0.0, 0.0]]))[0]
    return bool(typical.max() < _SMALL_PX * foreground.step)
