"""The run of a whole video from its slices: their steps, one after the other, go to the sinks of a run."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise, takewhile
from pathlib import Path

import numpy as np

from vidtrack.arrays import affine
from vidtrack.arrays.types import Floats, Ints
from vidtrack.config.settings import Settings
from vidtrack.output.confirmed import HOLD_S
from vidtrack.output.sink import Step, in_other_scene
from vidtrack.run.run import Extras, Pipeline
from vidtrack.run.sinks import file_sinks, file_subject
from vidtrack.run.slices.cuts import OVERLAP_S, Cut
from vidtrack.run.slices.kept import About, kept_steps, read_about
from vidtrack.run.slices.seam import Seam, handed_on, seam
from vidtrack.run.slices.track import SCENE
from vidtrack.run.trackers import build_blob_tracker
from vidtrack.tracks import Tracks
from vidtrack.video.stats import SourceStats


@dataclass(frozen=True, slots=True)
class Slice:
    """A tracked slice in its folder."""

    folder: Path
    cut: Cut
    about: About

    def steps(self, from_s: float, to_s: float) -> Iterator[Step]:
        """The steps from one time to before another [s]."""
        return takewhile(lambda step: step.time_s < to_s, kept_steps(self.folder, self.about, from_s))


class Whole:
    """The source of a whole video, as its slices read it; see `Source`."""

    def __init__(self, slices: Sequence[Slice]) -> None:
        first = slices[0].about
        self.fps, self.width, self.height = first.fps, first.width, first.height
        each = [SourceStats(**slice.about.stats) for slice in slices]
        self.stats = replace(
            each[0],
            frames_read=0,
            decode_errors=sum(stats.decode_errors for stats in each),
            truncated=any(stats.truncated for stats in each),
        )


@contextmanager
def stitched_pipeline(
    path: str, cuts: Sequence[Cut], folders: Sequence[Path], settings: Settings
) -> Iterator[Pipeline]:
    """The pipeline of a video that was tracked in slices; `path` as the user wrote it. Raises FormatError."""
    slices = [Slice(*pair, read_about(pair[0])) for pair in zip(folders, cuts, strict=True)]
    source = Whole(slices)
    slices = [slice for slice in slices if slice.about.ends]  # those beyond the true end are empty
    last = slices[-1]
    motion = build_blob_tracker(settings.tracker, (source.width, source.height)).model
    subject = file_subject(path, source, lambda: last.about.rates, settings, scene=lambda: np.load(last.folder / SCENE))
    yield Pipeline(
        name=Path(path).stem,
        place=Path(path),
        count=None,
        steps=_counted(stitched(slices), source.stats),
        summary=subject.summary,
        sinks=partial(
            file_sinks, subject, Extras(), motion=motion, hold_s=HOLD_S, smooth=bool(settings.output.smooth),
            link_s=settings.output.link_s if settings.output.link else None,
        ),
    )  # fmt: skip


def stitched(slices: Sequence[Slice]) -> Iterator[Step]:
    """The steps of all slices as of one run: frame numbers, ids and places go on over the seams."""
    naming, told = _Naming(), set[str]()
    seams = [_seam_of(*pair) for pair in pairwise(slices)]
    ends = [*(each.time_s for each in seams), np.inf]
    begin_s = -np.inf
    for slice, end_s, joint in zip(slices, ends, [None, *seams], strict=True):
        if joint is not None:
            naming.go_on(joint)
        for step in slice.steps(begin_s, end_s):
            news = tuple(what for what in step.warnings if what not in told)
            told.update(news)
            yield replace(naming.renamed(step), warnings=news)
        begin_s = end_s


def _seam_of(left: Slice, right: Slice) -> Seam:
    """The seam between neighbours, by their steps around the cut."""
    if right.cut.goes_on:
        *_, last = left.steps(left.about.ends[-1], np.inf)
        return handed_on(last, next(right.steps(-np.inf, np.inf)), right.about.before)
    begin_s = right.cut.begin_s
    window = begin_s - OVERLAP_S, begin_s + OVERLAP_S
    return seam(list(left.steps(*window)), list(right.steps(*window)), begin_s, left.about.fps)


def _counted(steps: Iterator[Step], stats: SourceStats) -> Iterator[Step]:
    """The steps; `stats` counts them as frames."""
    for step in steps:
        stats.frames_read += 1
        yield step


class _Naming:
    """From one slice's ids, groups, frame numbers and scene to those of the whole."""

    def __init__(self) -> None:
        self._known = np.empty(0, np.int64)  # ids of this slice that have a name, sorted
        self._names = np.empty(0, np.int64)
        self._first_id = self._first_group = 0  # of the ids and groups without a name
        self._next_id = self._next_group = 0
        self._shift = 0
        self._plane: Floats | None = None

    def go_on(self, seam: Seam) -> None:
        """The next steps are of the slice after this seam."""
        self._shift += seam.shift
        if seam.same_ids:
            return
        names = self._named(seam.left)
        self._next_id = max(self._next_id, int(names.max(initial=-1)) + 1)  # also those that came after the seam
        self._first_id, self._first_group = self._next_id, self._next_group
        order = np.argsort(seam.right)
        self._known, self._names = seam.right[order], names[order]
        if seam.plane is not None:
            self._plane = seam.plane if self._plane is None else affine.after(self._plane, seam.plane)

    def renamed(self, step: Step) -> Step:
        """A step of the current slice as a step of the whole."""
        tracks = step.tracks
        group = np.where(tracks.group < 0, -1, tracks.group + self._first_group)
        tracks = replace(tracks, id=self._named(tracks.id), group=group)
        self._next_id = max(self._next_id, int(tracks.id.max(initial=-1)) + 1)
        self._next_group = max(self._next_group, int(group.max(initial=-1)) + 1)
        step = replace(step, index=step.index + self._shift, tracks=_in_order(tracks))
        return step if self._plane is None else in_other_scene(step, self._plane)

    def _named(self, ids: Ints) -> Ints:
        if not len(self._known):
            return ids + self._first_id
        at = np.searchsorted(self._known, ids).clip(max=len(self._known) - 1)
        return np.where(self._known[at] == ids, self._names[at], ids + self._first_id)


def _in_order(tracks: Tracks) -> Tracks:
    """The rows in order of their ids, as a tracker gives them."""
    return tracks if np.all(np.diff(tracks.id) > 0) else tracks.only(np.argsort(tracks.id))
