"""Truth at the times of a result's scans, where both number scans or frames differently."""

from __future__ import annotations

import numpy as np

from vidtrack.arrays.types import Floats, Ints
from vidtrack.errors import FormatError
from vidtrack.formats import Table, interpolated, more_scans, scans_between, usual_step

STEPS = 2.0
"""Usual steps of a target of the truth; in a longer gap between two of its rows its place is not known."""


def by_time(result: Table, truth: Table) -> tuple[Table, Ints] | None:
    """The truth at the times of the result's scans, and the numbers of these scans, within the time of the truth.

    None where the numbers stand for the same times in both, or times are not known. Then the clocks may begin
    differently, else they may not. Where the truth begins before the result, or ends after it, there are more scans, in
    its usual step.
    Raises FormatError if no time is common, or times fall while the numbers rise, as in pooled tables.
    """
    if result.time_s is None or truth.time_s is None:
        return None
    common, first, second = np.intersect1d(result.frame, truth.frame, return_indices=True)
    ours, theirs = result.time_s[first], truth.time_s[second]
    if len(common) < 2 or not _of_other_times(ours, theirs):
        return None
    scan, time_s = scans_between(result.frame, result.time_s)
    _, truth_s = scans_between(truth.frame, truth.time_s)
    begin_s, end_s = truth_s.min(), truth_s.max()
    falls = any((np.diff(times) < 0).any() for times in (time_s, truth_s))  # a radar and a camera may have the same
    if falls or time_s[0] > end_s or time_s[-1] < begin_s:
        k = int(np.abs(ours - theirs - (ours - theirs)[0]).argmax())
        raise FormatError(
            f"number {common[k]} is at {ours[k]:.10g} s in the result and at {theirs[k]:.10g} s in the truth, which "
            "numbers other scans or frames, and their clocks are not the same; give the truth at the scans of the "
            "result, or in its time"
        )
    step_s = usual_step(time_s)
    if step_s:
        before, after = (max(0, int(off_s / step_s)) for off_s in (time_s[0] - begin_s, end_s - time_s[-1]))
        scan, time_s = more_scans(scan, time_s, step_s, before, after)
    inside = (begin_s <= time_s) & (time_s <= end_s)
    scan, time_s = scan[inside], time_s[inside]
    found = interpolated(truth, scan, time_s, STEPS * _usual_steps(truth.id, truth.time_s))
    if not len(found):
        raise FormatError("no target of the truth has two rows in its usual step around a scan of the result")
    return found, scan


def _of_other_times(ours: Floats, theirs: Floats) -> bool:
    """Whether most of the common numbers stand for other times (N,)."""
    off = ours - theirs
    step_s = max(np.median(np.diff(ours)), np.median(np.diff(theirs)))
    return bool(np.median(np.abs(off - np.median(off))) > step_s / 2)


def _usual_steps(target: Ints, time_s: Floats) -> Floats:
    """Median time between rows of each target, in ascending order of their ids; 0 where it has one row."""
    steps = [np.diff(np.sort(time_s[target == one])) for one in np.unique(target)]
    return np.array([np.median(each) if len(each) else 0.0 for each in steps])
