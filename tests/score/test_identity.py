"""IDF1 by hand."""

import numpy as np
import pytest

from vidtrack.formats import Table, box_table
from vidtrack.score import identity, match_boxes


def still(*entries: tuple) -> Table:
    """A table from (frame, id) of one and the same box."""
    frame, ids = np.array(entries, dtype=int).reshape(-1, 2).T
    return box_table(frame, ids, np.tile([0.0, 0, 10, 10], (len(frame), 1)))


def test_only_the_longest_track_of_an_object_counts():
    truth = still(*((f, 1) for f in range(10)))
    result = still(*((f, 7 if f < 6 else 8) for f in range(10)))
    found = identity(match_boxes(result, truth))
    assert (found.idf1, found.idp, found.idr) == pytest.approx((0.6, 0.6, 0.6))


def test_precision_and_recall_are_of_result_and_truth():
    truth = still(*((f, 1) for f in range(10)))
    found = identity(match_boxes(still(*((f, 7) for f in range(5))), truth))
    assert (found.idf1, found.idp, found.idr) == pytest.approx((2 * 5 / 15, 1.0, 0.5))


def test_one_track_serves_one_object_only():
    far = [(f, 2) for f in range(4)]
    truth = still(*((f, 1) for f in range(4, 10)), *far)
    found = identity(match_boxes(still(*((f, 7) for f in range(10))), truth))
    assert found.idf1 == pytest.approx(0.6)


def test_pairing_is_global_not_greedy():
    # track 7 shares 5 rows with object 1 and 4 with object 2; track 8 shares 4 with object 1 only
    truth = still(*((f, 1) for f in range(9)), *((f, 2) for f in range(9, 13)))
    result = still(*((f, 7) for f in range(5)), *((f, 8) for f in range(5, 9)), *((f, 7) for f in range(9, 13)))
    assert identity(match_boxes(result, truth)).idr == pytest.approx(8 / 13)


def test_rows_below_the_threshold_are_not_shared():
    truth = box_table(np.zeros(1), np.ones(1), np.array([[0, 0, 10, 10]]))
    result = box_table(np.zeros(1), np.ones(1), np.array([[5, 0, 10, 10]]))
    assert identity(match_boxes(result, truth)).idf1 == 0
    assert identity(match_boxes(result, truth), threshold=0.3).idf1 == 1


def test_an_empty_result_is_zero():
    assert identity(match_boxes(still(), still((0, 1)))).idf1 == 0
