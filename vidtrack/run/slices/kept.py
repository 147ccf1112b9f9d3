"""The steps of a slice in files, so that another process can stitch them."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from vidtrack.errors import FormatError
from vidtrack.output.folder import replacing, writing
from vidtrack.output.sink import Step
from vidtrack.output.tables import stacked
from vidtrack.scan import Scan
from vidtrack.tracks import Tracks
from vidtrack.video.frame import Frame

_BLOCK = 500
"""Steps in a file: a minute of ten vehicles takes about 6 MB."""
ABOUT = "slice.json"
"""What is known of a slice besides its steps; written last, so its presence tells that the slice is complete."""
_TRACK, _SCAN, _STAGE = "track.", "scan.", "stage."


@dataclass(frozen=True, slots=True)
class About:
    """What is known of a slice besides its steps.

    fps, width, height   of the source
    stats    the source's counters
    rates    the tracker's estimates
    stages   names of the stages that are timed
    columns  columns of position and of velocity in the state
    ends     time of the last step of each block [s]
    before   number of the last frame before the slice, as it counts; None if it begins with its first frame
    """

    fps: float
    width: int
    height: int
    stats: Mapping[str, Any]
    rates: Mapping[str, float]
    stages: tuple[str, ...] = ()
    columns: tuple[tuple[int, ...], tuple[int, ...]] = ((0, 2), (1, 3))
    ends: tuple[float, ...] = ()
    before: int | None = None


class KeptSteps:
    """Sink that writes steps in blocks, without pictures and without the reasons of decisions."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._waiting: list[Step] = []
        self._ends: list[float] = []
        self._stages: tuple[str, ...] = ()
        self._columns: tuple[tuple[int, ...], tuple[int, ...]] = ((0, 2), (1, 3))

    def step(self, step: Step) -> None:
        """Receive a step."""
        self._waiting.append(replace(step, frame=None, foreground=None))
        if len(self._waiting) == _BLOCK:
            self._write()

    def close(self) -> None:
        """Write the rest."""
        self._write()

    def about(self, about: About) -> None:
        """Write what else is known; the slice is then complete."""
        told = replace(about, stages=self._stages, columns=self._columns, ends=tuple(self._ends))
        with replacing(self._folder / ABOUT) as new:
            new.write_text(json.dumps(asdict(told)))

    def _write(self) -> None:
        if not self._waiting:
            return
        steps, self._waiting = self._waiting, []
        self._stages = tuple(steps[0].stage_s)
        self._columns = steps[0].tracks.position, steps[0].tracks.velocity
        path = _block(self._folder, len(self._ends))
        with writing(path):
            np.savez(path, allow_pickle=False, **_arrays(steps))
        self._ends.append(steps[-1].time_s)


def read_about(folder: Path) -> About:
    """What is known of a slice. Raises FormatError."""
    try:
        told = json.loads((folder / ABOUT).read_text())
        position, velocity = told["columns"]
        return About(**told | {"columns": (tuple(position), tuple(velocity))})
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise FormatError(f"the slice {folder} is damaged: {error}") from None


def kept_steps(folder: Path, about: About, from_s: float = -np.inf) -> Iterator[Step]:
    """The steps of a slice that are not before a time, with blank frames. Raises FormatError."""
    blank = Frame.blank((about.height, about.width), coloured=False)
    for number, end_s in enumerate(about.ends):
        if end_s >= from_s:
            try:
                with np.load(_block(folder, number), allow_pickle=False) as file:
                    block = {name: file[name] for name in file.files}
            except (OSError, ValueError, EOFError) as error:
                raise FormatError(f"the slice {folder} is damaged: {error}") from None
            yield from (step for step in _steps(block, about, blank) if step.time_s >= from_s)


def _block(folder: Path, number: int) -> Path:
    return folder / f"{number:05d}.npz"


def _columns(first: Tracks) -> list[str]:
    """Names of what a snapshot says of each track."""
    return [column.name for column in fields(first) if isinstance(getattr(first, column.name), np.ndarray)]


def _arrays(steps: list[Step]) -> dict[str, np.ndarray]:
    """The steps as arrays: those of tracks and measurements one after the other, with their numbers."""
    scans = [step.scan for step in steps]
    none, no_edges, no_box = np.full((2, 3), np.nan), np.full(4, np.nan), np.empty((0, 4))
    return {
        "index": np.array([step.index for step in steps]),
        "time_s": np.array([step.time_s for step in steps]),
        "motion": np.array([none if step.motion is None else step.motion for step in steps]),
        "tracks": np.array([len(step.tracks) for step in steps]),
        "scans": np.array([len(scan) for scan in scans]),
        "warnings": np.array([json.dumps(step.warnings) for step in steps]),
        **{f"{_TRACK}{name}": stacked(steps, name) for name in _columns(steps[0].tracks)},
        **{f"{_STAGE}{name}": np.array([step.stage_s[name] for step in steps]) for name in steps[0].stage_s},
        f"{_SCAN}z": np.concatenate([scan.z.reshape(-1, 2) for scan in scans]),
        f"{_SCAN}box": np.concatenate([no_box if scan.box is None else scan.box for scan in scans]),
        f"{_SCAN}surveyed": np.array([no_edges if scan.surveyed is None else scan.surveyed for scan in scans]),
        f"{_SCAN}pixel": np.array([scan.pixel for scan in scans]),
        f"{_SCAN}rim": np.array([scan.rim for scan in scans]),
    }  # fmt: skip


def _steps(block: dict[str, np.ndarray], about: About, blank: Frame) -> Iterator[Step]:
    """The steps of a block. Their scans have no covariances: no sink asks for them."""
    position, velocity = about.columns
    rows: dict[str, Any] = {
        name.removeprefix(_TRACK): values for name, values in block.items() if name.startswith(_TRACK)
    }
    track = np.concatenate([[0], np.cumsum(block["tracks"])])
    scan = np.concatenate([[0], np.cumsum(block["scans"])])
    for k, (index, time_s) in enumerate(zip(block["index"].tolist(), block["time_s"].tolist(), strict=True)):
        own, seen = slice(track[k], track[k + 1]), slice(scan[k], scan[k + 1])
        edges, motion = block["scan.surveyed"][k], block["motion"][k]
        yield Step(
            index,
            time_s,
            Scan(
                time_s,
                block["scan.z"][seen],
                np.eye(2),
                box=block["scan.box"][seen],
                surveyed=None if np.isnan(edges[0]) else edges,
                pixel=float(block["scan.pixel"][k]),
                rim=float(block["scan.rim"][k]),
            ),
            Tracks(time_s, **{n: values[own] for n, values in rows.items()}, position=position, velocity=velocity),
            replace(blank, index=index, time_s=time_s),
            None,
            {name: float(block[f"{_STAGE}{name}"][k]) for name in about.stages},
            None if np.isnan(motion[0, 0]) else motion,
            tuple(json.loads(str(block["warnings"][k]))),
        )
