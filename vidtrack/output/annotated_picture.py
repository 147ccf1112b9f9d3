"""One picture of a camera with its tracks, its lines and the time of day, as JPEG."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from datetime import datetime

from vidtrack.output.draw import Pen, draw_clock, draw_lines, draw_tracks, moved_lines
from vidtrack.output.scene import jpeg
from vidtrack.output.sink import Step
from vidtrack.traffic.lines import Line


def annotated_jpeg(
    step: Step, lines: Sequence[Line], totals: Mapping[str, Mapping[str, int]] | None, wall: datetime, quality: int
) -> bytes:
    """The picture of a step, which must have one; with `totals` the lines show their counts."""
    assert step.frame is not None
    picture = step.frame.bgr()
    pen = Pen(picture)
    draw_lines(pen, moved_lines(lines, step.motion), totals)
    draw_tracks(pen, step.shown)
    draw_clock(pen, f"{wall:%Y-%m-%d %H:%M:%S}")
    return jpeg(picture, quality)
