"""OSPA and GOSPA by hand, against brute force, and as metrics."""

from itertools import permutations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from vidtrack.errors import ConfigError
from vidtrack.formats import Table, box_table
from vidtrack.score import gospa, match_boxes, match_points, ospa

CUTOFF = 10.0
ORDERS = st.sampled_from([1.0, 2.0])
SETS = arrays(float, st.tuples(st.integers(0, 4), st.just(2)), elements=st.integers(-8, 8).map(float))


def points(xy) -> Table:
    xy = np.asarray(xy, dtype=float).reshape(-1, 2)
    return Table(np.zeros(len(xy), int), np.arange(len(xy)), xy, None, np.ones(len(xy)))


def of_sets(metric, x, y, order=2.0, cutoff=CUTOFF):
    return metric(match_points(points(x), points(y), max_distance=5, reach=cutoff), cutoff, order)


def distance(metric, x, y, order) -> float:
    """Two empty sets share no frame; their distance is 0."""
    return float(of_sets(metric, x, y, order).distance.sum())


def test_one_object_each_is_their_distance():
    assert of_sets(ospa, [[0, 0]], [[3, 4]]).distance == pytest.approx(5)
    assert of_sets(gospa, [[0, 0]], [[3, 4]]).distance == pytest.approx(5)


def test_distances_are_cut_off():
    assert of_sets(ospa, [[0, 0]], [[300, 400]]).distance == pytest.approx(CUTOFF)
    assert of_sets(gospa, [[0, 0]], [[300, 400]]).distance == pytest.approx(CUTOFF)


@pytest.mark.parametrize(("order", "expected"), [(1, (3 + 10) / 2), (2, np.sqrt((9 + 100) / 2))])
def test_ospa_of_one_missing_object(order, expected):
    found = of_sets(ospa, [[0, 0]], [[0, 3], [80, 0]], order)
    assert found.distance == pytest.approx(expected)
    assert found.localisation == pytest.approx((3**order / 2) ** (1 / order))
    assert found.cardinality == pytest.approx((10**order / 2) ** (1 / order))


def test_gospa_parts_of_a_missed_and_two_false_objects():
    found = of_sets(gospa, [[0, 3], [70, 0], [90, 0]], [[0, 0], [-70, 0]])
    assert found.localisation == pytest.approx(3)
    assert found.missed == pytest.approx(np.sqrt(50))
    assert found.false == pytest.approx(np.sqrt(100))
    assert found.distance == pytest.approx(np.sqrt(9 + 50 + 100))


def test_boxes_use_one_minus_iou():
    a = box_table(np.zeros(1), np.zeros(1), np.array([[0, 0, 10, 10]]))
    b = box_table(np.zeros(1), np.zeros(1), np.array([[5, 0, 10, 10]]))
    assert ospa(match_boxes(a, b), cutoff=1).distance == pytest.approx(2 / 3)


def test_each_frame_has_its_own_distance():
    truth = Table(np.array([0, 1, 1]), np.array([1, 1, 2]), np.array([[0.0, 0], [0, 0], [50, 0]]), None, np.ones(3))
    result = Table(np.array([0, 2]), np.array([1, 1]), np.array([[0.0, 6], [0, 0]]), None, np.ones(2))
    found = ospa(match_points(result, truth, max_distance=5), CUTOFF)
    np.testing.assert_allclose(found.distance, [6, CUTOFF, CUTOFF])


@pytest.mark.parametrize(("cutoff", "order"), [(0, 2), (-1, 2), (10.1, 2), (np.nan, 2), (10, 0.5), (10, np.inf)])
def test_senseless_parameters_are_refused(cutoff, order):
    matchup = match_points(points([[0, 0]]), points([[0, 0]]), max_distance=5)
    with pytest.raises(ConfigError, match="must be"):
        ospa(matchup, cutoff, order)


def test_a_very_high_order_tends_to_the_largest_distance():
    assert of_sets(ospa, [[0, 0], [50, 0]], [[0, 3], [50, 8]], order=300).distance == pytest.approx(8, rel=1e-2)


@given(SETS, SETS, ORDERS)
def test_ospa_equals_brute_force(x, y, order):
    small, large = sorted((x, y), key=len)
    if not len(large):
        return
    cost = np.minimum(np.linalg.norm(small[:, None] - large[None], axis=2), CUTOFF) ** order
    best = min(cost[range(len(small)), list(p)].sum() for p in permutations(range(len(large)), len(small)))
    expected = ((best + CUTOFF**order * (len(large) - len(small))) / len(large)) ** (1 / order)
    assert of_sets(ospa, x, y, order).distance == pytest.approx(expected, abs=1e-9)


@given(SETS, SETS, ORDERS)
def test_parts_add_up(x, y, order):
    for metric in (ospa, gospa):
        found = of_sets(metric, x, y, order)
        parts = [getattr(found, name) ** order for name in found.__slots__ if name != "distance"]
        np.testing.assert_allclose(found.distance**order, sum(parts), atol=1e-9)


@given(SETS, SETS, SETS, ORDERS)
def test_both_are_metrics(x, y, z, order):
    for metric in (ospa, gospa):
        between = distance(metric, x, y, order)
        assert distance(metric, x, x, order) == pytest.approx(0, abs=1e-6)
        assert distance(metric, y, x, order) == pytest.approx(between)
        assert between <= distance(metric, x, z, order) + distance(metric, z, y, order) + 1e-9
        assert (between > 1e-9) == (sorted(x.tolist()) != sorted(y.tolist()))
