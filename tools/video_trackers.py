"""Those who compete in the video benchmarks: vidtrack, and two scripts of a user (peers/count_lines.py)."""

from __future__ import annotations

import json
import subprocess
import tempfile
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from peers.environment import python_of
from score_events import Event, read_counts
from video_clips import Clip

from vidtrack import formats
from vidtrack.config.load import load
from vidtrack.formats import Table
from vidtrack.run.files import run_file
from vidtrack.run.run import Extras
from vidtrack.video.frame import Image

SCRIPTS = {"MOG2 + SORT": ("MOG2", "SORT"), "KNN + ByteTrack": ("KNN", "ByteTrack")}


@dataclass(frozen=True)
class Tracked:
    """What came out of a clip: counts, tracks, and masks if the clip wants them."""

    counts: list[Event]
    tracks: Table
    masks: list[Image]


Contender = Callable[[Sequence[Clip]], Iterator[Tracked]]
"""Tracks clips, one after the other."""


def contenders(assignments: Sequence[str], peers_in: Path | None) -> dict[str, Contender]:
    """vidtrack with settings as for --set, and, given the folder of their environment, both scripts."""
    ours: dict[str, Contender] = {"vidtrack": Ours(assignments)}
    if peers_in is None:
        return ours
    python = python_of("counting", peers_in)
    return ours | {name: Script(python, peers_in / "results", *parts) for name, parts in SCRIPTS.items()}


class Ours:
    """vidtrack at its defaults but for `assignments`, as `vidtrack track` runs it."""

    def __init__(self, assignments: Sequence[str] = ()) -> None:
        self._assignments = list(assignments)

    def __call__(self, clips: Sequence[Clip]) -> Iterator[Tracked]:
        for clip in clips:
            rate = [] if clip.fps is None else [("source.fps", clip.fps)]
            lines = [("output.lines", list(clip.lines))] if clip.lines else []
            settings = load(None, [*self._assignments, *rate, *lines])
            with tempfile.TemporaryDirectory() as place:
                masks = Path(place) / "masks" if clip.masked else None
                with run_file(str(clip.video), settings, Path(place) / "run", Extras(masks=masks)) as run:
                    for _ in run:
                        pass
                yield _read(run.folder / "counts.csv", formats.read(run.folder), masks)


class Script:
    """Background subtraction and a tracker of roboflow `trackers`; what it gave is kept until a clip changes."""

    def __init__(self, python: Path, kept: Path, background: str, tracker: str) -> None:
        self._python, self._kept = python, kept / f"{background}-{tracker}".lower()
        self._parts = {"background": background, "tracker": tracker}

    def __call__(self, clips: Sequence[Clip]) -> Iterator[Tracked]:
        self._run([clip for clip in clips if not self._is_kept(clip)])
        for clip in clips:
            folder = self._kept / clip.name
            with np.load(folder / "tracks.npz") as stored:
                tracks = formats.box_table(stored["frame"], stored["id"], stored["box"])
            yield _read(folder / "counts.csv", tracks, folder / "masks" if clip.masked else None)

    def _is_kept(self, clip: Clip) -> bool:
        result = self._kept / clip.name / "tracks.npz"  # written last
        return result.is_file() and result.stat().st_mtime > clip.video.stat().st_mtime

    def _run(self, clips: Sequence[Clip]) -> None:
        if not clips:
            return
        jobs = []
        for clip in clips:
            folder = self._kept / clip.name
            (folder / "masks").mkdir(parents=True, exist_ok=True)
            video = clip.video / "in%06d.jpg" if clip.video.is_dir() else clip.video
            files = {"counts": folder / "counts.csv", "tracks": folder / "tracks.npz"}
            files |= {"masks": folder / "masks"} if clip.masked else {}
            paths = {name: str(path) for name, path in ({"video": video} | files).items()}
            jobs.append({"masks": None, "lines": clip.lines, **self._parts, **paths})
        listed = self._kept / "jobs.json"
        listed.write_text(json.dumps(jobs))
        subprocess.run([self._python, Path(__file__).parent / "peers" / "count_lines.py", listed], check=True)


def _read(counts: Path, tracks: Table, masks: Path | None) -> Tracked:
    pictures = [] if masks is None else [_grey(path) for path in sorted(masks.glob("*.png"))]
    return Tracked(read_counts(counts) if counts.is_file() else [], tracks, pictures)


def _grey(path: Path) -> Image:
    picture = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
    assert picture is not None  # just written
    return np.asarray(picture, np.uint8)
