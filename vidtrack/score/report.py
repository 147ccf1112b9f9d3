"""All scores of a result in one dictionary."""

from __future__ import annotations

import math
from dataclasses import asdict

import numpy as np

from vidtrack.errors import ConfigError, FormatError
from vidtrack.formats import Table
from vidtrack.score.clear import clear, correspondences
from vidtrack.score.consistency import consistency, nees
from vidtrack.score.hota import hota
from vidtrack.score.identity import identity
from vidtrack.score.matching import Matchup, match_boxes, match_points
from vidtrack.score.ospa import gospa, ospa
from vidtrack.score.times import by_time

MAX_DISTANCE = {"px": 20.0, "m": 100.0}
POINT_THRESHOLD = 0.5  # the similarity of two points at the largest distance


def evaluate(
    result: Table,
    truth: Table,
    *,
    iou: float = 0.5,
    points: bool = False,
    max_distance: float | None = None,
    cutoff: float | None = None,
    order: float = 2.0,
    states: Table | None = None,
) -> dict[str, float | int | str]:
    """All scores of `result` against `truth`, by name; fractions, not percent.

    Truth rows with conf 0 are ignored. Boxes match at an IoU of at least `iou`. Points are matched if
    `points` is set or a table has no boxes, within `max_distance` (None: 20 px or 100 m).
    OSPA and GOSPA use 1 - IoU or the distance, `cutoff` (None: 1 for boxes, max_distance for points)
    and `order`; they are means over the frames in which truth or result has a row, and so are their parts.
    NIS and NEES are from `states` (None: result) if it has the columns.
    Where most scan numbers stand for other times in the truth than in the result, its positions are interpolated at the
    times of the result, and points are matched; what it has before and after the result is missed.
    Raises FormatError for tables without identities, a truth without rows, and clocks with no time in common;
    ConfigError for bad options.
    """
    truth = truth.select(truth.conf != 0)
    if not len(truth):
        raise FormatError("the truth has no rows with conf above 0; there is nothing to score against")
    for name, table in (("result", result), ("truth", truth)):
        if (table.id < 0).any():
            raise FormatError(f"the {name} has rows without identity (id -1); give tracks, not detections")

    if not 0 < iou <= 1:
        raise ConfigError(f"iou is {iou}; it must be above 0 and at most 1")
    if max_distance is None:
        max_distance = MAX_DISTANCE[truth.unit]
    if not 0 < max_distance < math.inf:
        raise ConfigError(f"max_distance is {max_distance}; it must be a finite number above 0")

    timed = by_time(result, truth)
    if timed is not None:
        truth, scans = timed
        result = result.select(np.isin(result.frame, scans))
        states = None if states is None else states.select(np.isin(states.frame, scans))
    at = "" if timed is None else ", the truth at the times of the scans"
    points = points or result.box is None or truth.box is None
    if cutoff is None:
        cutoff = max_distance if points else 1.0
    matched_by = f"distance up to {max_distance:g} {truth.unit}{at}" if points else f"IoU from {iou:g}"
    threshold = POINT_THRESHOLD if points else iou

    def match(table: Table) -> Matchup:
        return match_points(table, truth, max_distance, cutoff) if points else match_boxes(table, truth)

    matchup = match(result)
    states = result if states is None else states
    return {
        "matched_by": matched_by,
        **_counts(matchup),
        **asdict(clear(matchup, threshold)),
        **asdict(identity(matchup, threshold)),
        **asdict(hota(matchup)),
        **_set_distances(matchup, cutoff, order),
        **_consistency(states, truth, matchup if states is result else match(states), threshold),
    }


def _counts(matchup: Matchup) -> dict[str, int]:
    return {
        "frames": len(matchup.truth_count),
        "truth_rows": len(matchup.truth_frame),
        "truth_tracks": len(np.unique(matchup.truth_id)),
        "rows": len(matchup.result_frame),
        "tracks": len(np.unique(matchup.result_id)),
    }


def _set_distances(matchup: Matchup, cutoff: float, order: float) -> dict[str, float]:
    """OSPA, GOSPA and their parts, averaged over frames."""
    by_name = {"cutoff": cutoff, "order": order}
    for name, metric in (("ospa", ospa), ("gospa", gospa)):
        parts = asdict(metric(matchup, cutoff, order))
        by_name[name] = float(parts.pop("distance").mean())
        by_name |= {f"{name}_{part}": float(value.mean()) for part, value in parts.items()}
    return by_name


def _consistency(states: Table, truth: Table, matchup: Matchup, threshold: float) -> dict[str, float]:
    """NIS and NEES with their bounds, named nis, nis_low, ..., if the table has the columns."""
    matched = correspondences(matchup, threshold)
    values = {"nees": nees(states, truth, matchup.result[matched], matchup.truth[matched])}
    if states.nis is not None:
        values["nis"] = states.nis
    by_name = {}
    for name, value in values.items():
        found = consistency(value, dim=states.xy.shape[1])
        if found is not None:
            parts = asdict(found)
            by_name[name] = parts.pop("mean")
            by_name |= {f"{name}_{part}": number for part, number in parts.items()}
    return by_name
