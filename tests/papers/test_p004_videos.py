from types import SimpleNamespace

import numpy as np
import pytest

from vidtrack.papers.p004.clips import Watched, ids_on_targets, unshared, watch
from vidtrack.papers.p004.fig5 import moments, outcome
from vidtrack.papers.p004.fig6 import lost_identities
from vidtrack.papers.p004.junction import DEFAULT, GREY, LINE, NEAR, REGION, filmed, junction_outcome, uncovered
from vidtrack.simulate import simulate
from vidtrack.tracks import Status


def tracks(*rows):
    """A snapshot with (id, x, y) of confirmed tracks."""
    return SimpleNamespace(
        id=np.array([row[0] for row in rows], np.int64),
        status=np.full(len(rows), Status.CONFIRMED),
        xy=np.array([row[1:] for row in rows], float).reshape(-1, 2),
    )


@pytest.fixture
def two():
    """Two targets that stand 100 px apart for three frames."""
    centre = np.tile([[50.0, 50.0], [150.0, 50.0]], (3, 1, 1))
    box = np.concatenate([centre - 5, np.full((3, 2, 2), 10.0)], axis=-1)
    return Watched(None, [], np.ones((3, 2), bool), centre, box)


@pytest.mark.parametrize(
    ("end", "expected"),
    [
        (((1, 51, 50), (2, 149, 50)), "correct"),
        (((2, 51, 50), (1, 149, 50)), "swap"),
        (((1, 51, 50), (2, 52, 50)), "merge"),
        (((1, 51, 50), (2, 149, 90)), "lost"),
        (((1, 51, 50), (3, 149, 50)), "lost"),
    ],
)
def test_outcomes_of_a_crossing(two, end, expected):
    start = tracks((1, 50, 50), (2, 150, 50))
    assert outcome(two, [start, start, tracks(*end)], before=0, end=2) == expected


def test_identities_lost(two):
    start = tracks((1, 50, 50), (2, 150, 50))
    steps = [start, start, tracks((1, 50, 50), (7, 150, 50))]
    np.testing.assert_array_equal(ids_on_targets(two, steps)[2], [1, 7])
    np.testing.assert_array_equal(lost_identities(two, steps), [1])
    np.testing.assert_array_equal(lost_identities(two, [start] * 3), [])


def test_shared_blobs_are_taken_out_while_the_targets_touch_and_no_longer():
    watched = watch(simulate("crossing", seed=3))
    before, end = moments(watched)
    kept = unshared(watched)
    assert len(kept[before]) == len(watched.scans[before]) == 2
    assert len(kept[before + 5]) == 0 < len(watched.scans[before + 5])
    assert len(kept[end]) == len(watched.scans[end]) == 2


def test_the_white_car_survives_the_stop_line_by_confidence_region_and_not_by_minimum_distance():
    films = filmed(0)
    near, region = junction_outcome(*films[NEAR]), junction_outcome(*films[REGION])
    assert not near.white_kept
    assert region.fate == "none"
    assert region.white_kept
    usual = junction_outcome(*films[DEFAULT])
    assert usual.fate == "none"
    assert usual.white_kept


def test_the_line_is_uncovered_between_the_grey_and_the_white_car():
    watched, _ = filmed(0)[NEAR]
    free, arrives = uncovered(watched)
    assert 10 < arrives - free < 40
    left, _, width, _ = watched.box[free, GREY]
    assert left + width < LINE[0] + 10
