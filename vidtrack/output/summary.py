"""summary.json: one JSON object per run, valid at any time."""

from __future__ import annotations

import json
import math
import platform
import time
from collections.abc import Callable, Mapping
from functools import cache
from importlib.metadata import version
from pathlib import Path

from vidtrack.arrays import affine
from vidtrack.config.settings import Settings
from vidtrack.output.linefile import Every, replace_text
from vidtrack.output.sink import Step
from vidtrack.output.watched import Watched
from vidtrack.tracks import TENTATIVE

_PACKAGES = ("vidtrack", "numpy", "scipy", "opencv-python-headless", "av", "numba", "pyarrow", "rerun-sdk")


class CameraAccount:
    """Statistics of the camera's motion relative to the first picture."""

    def __init__(self) -> None:
        self._time_s: float | None = None
        self._moved_s = 0.0
        self._largest_px = 0.0
        self._squares = 0.0
        self._frames = 0

    def step(self, step: Step) -> None:
        """Add one picture's motion."""
        if step.frame is None:
            return
        dt = 0.0 if self._time_s is None else step.time_s - self._time_s
        self._time_s = step.time_s
        self._frames += 1
        if step.motion is not None:
            height, width = step.frame.shape
            px = affine.displacement(step.motion, width, height, affine.IDENTITY)
            self._moved_s += dt
            self._largest_px = max(self._largest_px, px)
            self._squares += px * px

    def as_dict(self) -> dict[str, float]:
        """Time away from the first view [s], largest and RMS displacement [px] of the corner that moved most."""
        rms_px = math.sqrt(self._squares / max(self._frames, 1))
        return {
            "moved_s": round(self._moved_s, 3),
            "largest_px": round(self._largest_px, 2),
            "rms_px": round(rms_px, 2),
        }


class Summary:
    """Sink that writes summary.json at the start, every second and at the end.

    source   name of the input, without any password
    reading  returns the source's counters: fps, width, height, frames_read, frames_dropped, decode_errors,
             reconnects, stalls, truncated
    counts   returns the counts by line and direction; None without counting lines
    unit     of the steps: "frames" or "scans"
    usual_s  nominal time between two frames

    `interrupted` is True until the run clears it before `close`, so the file of a killed or failed run has it True.
    """

    def __init__(
        self,
        path: Path,
        source: str,
        settings: Settings,
        reading: Callable[[], Mapping[str, object]],
        counts: Callable[[], Mapping[str, Mapping[str, int]]] | None = None,
        unit: str = "frames",
        usual_s: float = 0.0,
    ) -> None:
        self.interrupted = True
        self._path = path
        self._source = source
        given = {"settings": settings.model_dump(mode="json"), "versions": _versions()}
        self._given = _entries(given)  # as text once: it takes nine tenths of the time, every second
        self._reading = reading
        self._counts = counts
        self._unit = unit
        self._start = time.monotonic()
        self._frames = 0
        self._media_s = 0.0
        self._rim_px = 0.0
        self._tracks = 0
        self._alive: set[int] = set()
        self._stage_s: dict[str, float] = {}
        self._camera = CameraAccount()
        self._watched = Watched(usual_s)
        self._warnings: list[dict[str, object]] = []
        self._due = Every(1.0)
        self._write(interrupted=True)

    def step(self, step: Step) -> None:
        """Count the step and its tracks."""
        confirmed = set(step.tracks.id[step.tracks.status != TENTATIVE].tolist())
        self._tracks += len(confirmed - self._alive)
        self._alive = confirmed
        self._frames += 1
        self._media_s = step.time_s
        self._rim_px = step.scan.rim
        for stage, seconds in step.stage_s.items():
            self._stage_s[stage] = self._stage_s.get(stage, 0.0) + seconds
        self._camera.step(step)
        self._watched.add(step.time_s)
        self._warnings += ({"time_s": round(step.time_s, 3), "what": what} for what in step.warnings)
        if self._due():
            self._write(interrupted=True)

    def close(self) -> None:
        """Write the final object."""
        self._write(self.interrupted)

    def _so_far(self) -> dict[str, object]:
        """What changes from step to step, times in seconds.

        `seconds`: duration of the run; `media_s`: time of the last frame; `watched`: first and last frame of each span
        without a pause; `rim_px`: by how much boxes reach beyond vehicles on each side, in pixels of the source.
        """
        return {
            "source": self._source,
            **self._reading(),
            self._unit: self._frames,
            "media_s": round(self._media_s, 6),
            **(self._of_pictures() if self._unit == "frames" else {}),
            "tracks": self._tracks,
            "counts": {} if self._counts is None else self._counts(),
            "warnings": self._warnings,
            "seconds": round(time.monotonic() - self._start, 3),
            "stages": {stage: round(seconds, 4) for stage, seconds in self._stage_s.items()},
        }

    def _of_pictures(self) -> dict[str, object]:
        """What only pictures have."""
        return {"watched": self._watched.spans, "rim_px": self._rim_px, "camera": self._camera.as_dict()}

    def _write(self, interrupted: bool) -> None:
        parts = _entries(self._so_far()), self._given, _entries({"interrupted": interrupted})
        replace_text(self._path, f"{{{','.join(parts)}\n}}\n")


def _entries(content: Mapping[str, object]) -> str:
    """The entries of an object as JSON, without its braces."""
    return json.dumps(content, indent=2)[1:-2]


@cache
def _versions() -> dict[str, str]:
    """Versions of the packages, cached: each needs a package's whole metadata."""
    return {"python": platform.python_version()} | {name: version(name) for name in _PACKAGES}
