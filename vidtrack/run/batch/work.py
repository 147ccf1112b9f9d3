"""Does one task: the same on every engine."""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path

from vidtrack.config.load import parse
from vidtrack.config.settings import Settings
from vidtrack.errors import Error, FormatError, SourceError, StoppedEarly
from vidtrack.run.batch.place import Place, place_of
from vidtrack.run.batch.remote import is_remote, local_copy, without_secrets
from vidtrack.run.batch.task import Outcome, Task
from vidtrack.run.files import run_file
from vidtrack.run.run import Extras, Run
from vidtrack.run.slices.cuts import cuts
from vidtrack.run.slices.kept import ABOUT as ABOUT_SLICE
from vidtrack.run.slices.stitch import stitched_pipeline
from vidtrack.run.slices.track import STATE, track_slice
from vidtrack.video.resources import OPENCV
from vidtrack.video.source import duration_s

ABOUT = "source.json"
"""Beside the results of a source: which source, and its row of the index. Its presence tells that they are complete."""
_LEAST = 1.5
"""A file shorter than this many slices is not cut."""


def work(told: dict[str, object], beat: Callable[[], None]) -> Outcome:
    """Do a task; every error becomes an outcome.

    told  Task.as_dict()
    beat  called after each frame, and each piece of a copy
    """
    task = Task.of(told)
    begun = time.monotonic()
    try:
        outcome = _KINDS[task.kind](task, place_of(task.out), beat)
        return outcome | {"seconds": round(time.monotonic() - begun, 3)}
    except (SourceError, FormatError) as error:
        return {"error": _one_line(error), "again": False, "unreadable": True}
    except (StoppedEarly, OSError, MemoryError) as error:
        return {"error": _one_line(error), "again": True, "unreadable": False}
    except Error as error:
        return {"error": _one_line(error), "again": False, "unreadable": False}
    except Exception as error:  # one file must not end a batch of thousands
        return {"error": f"{type(error).__name__}: {_one_line(error)}", "again": False, "unreadable": False}


def _file(task: Task, place: Place, beat: Callable[[], None]) -> Outcome:
    """Track a file as `vidtrack track` does, or say where it is to be cut."""
    settings = parse(task.settings)
    if _can_be_cut(task, settings):
        length_s = duration_s(task.address) if Path(task.address).suffix.lower() != ".txt" else None
        if length_s is not None and length_s > _LEAST * task.slice_s:
            span = settings.source.start_s, settings.source.end_s
            found = cuts(*span, length_s, task.slice_s, task.warm_s)
            if len(found) > 1:
                return {"cuts": [_as_list(one) for one in found]}
    with local_copy(task.address, beat) as path, place.workspace() as folder:
        run = run_file(path, settings, folder, Extras(source=without_secrets(task.address)), force=True)
        return _finished(run, task, place, folder, beat)


def _can_be_cut(task: Task, settings: Settings) -> bool:
    """Whether a slice can be read by itself, and begin with the state of another one if it is to."""
    states = task.warm_s is not None or settings.detector.kind not in OPENCV
    return bool(task.slice_s) and states and not is_remote(task.address)


def _slice(task: Task, place: Place, beat: Callable[[], None]) -> Outcome:
    cut = task.cuts[task.number]
    with ExitStack() as stack:
        before = (
            stack.enter_context(place.local(task.slice_folder(cut.number - 1), beat, only=STATE))
            if cut.goes_on
            else None
        )
        folder = stack.enter_context(place.workspace())
        track_slice(task.address, parse(task.settings), cut, folder, before, beat)
        place.put(folder, task.slice_folder(cut.number), last=ABOUT_SLICE, beat=beat)
    return {"sliced": task.number}


def _stitch(task: Task, place: Place, beat: Callable[[], None]) -> Outcome:
    settings: Settings = parse(task.settings)
    with ExitStack() as stack:
        folders = [stack.enter_context(place.local(task.slice_folder(one.number), beat)) for one in task.cuts]
        folder = stack.enter_context(place.workspace())
        run = Run(stitched_pipeline(task.address, task.cuts, folders, settings), folder, force=True)
        outcome = _finished(run, task, place, folder, beat)
    place.remove(task.slices.rpartition("/")[0])
    return outcome


def _finished(run: Run, task: Task, place: Place, folder: Path, beat: Callable[[], None]) -> Outcome:
    """Do the run, and move its folder into place."""
    with run:
        for _ in run:
            beat()
    summary = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    found = {
        "frames": summary["frames"],
        "media_s": _watched_s(summary),
        "coverage": _coverage(summary),
        "tracks": summary["tracks"],
        "truncated": summary["truncated"],
    }
    about = task.about | found | {"key": task.key, "version": task.version}
    (folder / ABOUT).write_text(json.dumps(about, indent=2) + "\n", encoding="utf-8")
    place.put(folder, task.result, last=ABOUT, beat=beat)
    return {"done": found}


def _watched_s(summary: dict[str, object]) -> float:
    """Seconds of video in a run: all its spans, each with its last frame."""
    spans = summary["watched"]
    assert isinstance(spans, list)
    return round(sum(last - first + 1 / float(str(summary["fps"])) for first, last in spans), 3)


def _coverage(summary: dict[str, object]) -> float:
    """Share of the time from the first to the last frame that was watched."""
    spans = summary["watched"]
    assert isinstance(spans, list)
    whole = spans[-1][1] - spans[0][0] if spans else 0.0
    return round(sum(last - first for first, last in spans) / whole, 6) if whole else 1.0


def _as_list(cut: object) -> dict[str, object]:
    return {name: getattr(cut, name) for name in ("number", "begin_s", "end_s", "warm_s")}


def _one_line(error: BaseException) -> str:
    return " ".join(str(error).split()) or type(error).__name__


_KINDS = {"file": _file, "slice": _slice, "stitch": _stitch}
