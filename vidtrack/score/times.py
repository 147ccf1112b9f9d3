"""Truth at the times of a result's scans, where both number scans or frames differently."""

from __future__ import annotations

import numpy as np

from vidtrack.arrays.types import Floats, Ints
from vidtrack.errors import FormatError
from vidtrack.formats import Table, interpolated, scans_between

STEPS = 2.0
"""Usual steps of a target of the truth; in a longer gap between two of its rows its place is not known."""


def by_time(result: Table, truth: Table) -> tuple[Table, Ints] | None:
    """The truth at the times of the result's scans, and the numbers of these scans, within the time of the truth.

    None where the numbers stand for the same times in both, or times are not known. Then the clocks may begin
    differently, else they may not.
    Raises FormatError if no time is common, or times do not rise with the numbers, as in pooled tables.
    """
    if result.time_s is None or truth.time_s is None:
        return None
    common, first, second = np.intersect1d(result.frame, truth.frame, return_indices=True)
    ours, theirs = result.time_s[first], truth.time_s[second]
    if len(common) < 2 or not _of_other_times(ours, theirs):
        return None
    scan, time_s = scans_between(result.frame, result.time_s)
    steps_s = np.diff(truth.time_s[np.unique(truth.frame, return_index=True)[1]])
    usual_s = float(np.median(_steps(truth.id, truth.time_s)))
    inside = (truth.time_s.min() <= time_s) & (time_s <= truth.time_s.max())
    if not inside.any() or np.diff(time_s).min() <= 0 or steps_s.min() <= 0:
        k = int(np.abs(ours - theirs - (ours - theirs)[0]).argmax())
        raise FormatError(
            f"number {common[k]} is at {ours[k]:.10g} s in the result and at {theirs[k]:.10g} s in the truth, which "
            "numbers other scans or frames, and their clocks are not the same; give the truth at the scans of the "
            "result, or in its time"
        )
    scan, time_s = scan[inside], time_s[inside]
    return interpolated(truth, scan, time_s, STEPS * usual_s), scan


def _of_other_times(ours: Floats, theirs: Floats) -> bool:
    """Whether most of the common numbers stand for other times (N,)."""
    off = ours - theirs
    step_s = max(np.median(np.diff(ours)), np.median(np.diff(theirs)))
    return bool(np.median(np.abs(off - np.median(off))) > step_s / 2)


def _steps(target: Ints, time_s: Floats) -> Floats:
    """Times between rows of one target, over all targets (N,)."""
    order = np.lexsort((time_s, target))
    return np.diff(time_s[order])[np.diff(target[order]) == 0]
