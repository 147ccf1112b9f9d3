"""Classes of rows: by the lengths so far."""

import numpy as np
import pytest

from vidtrack.traffic.vehicles.naming import Naming

LORRY, CAR = 12.0, 4.4


def test_a_class_is_by_all_lengths_so_far_and_those_of_one_track():
    naming = Naming({"car": (3.0, 6.0), "lorry": (6.0, 18.0)})
    track, length = np.array([1, 2, 1, 2]), np.array([LORRY, CAR, np.nan, 5.9])
    names, mean, _ = naming.named(track, length, np.full(4, 0.9), np.full(4, 10.0), np.zeros(4, bool))
    assert names.tolist() == ["lorry", "car", "lorry", "car"]
    assert mean == pytest.approx([LORRY, CAR, LORRY, (CAR + 5.9) / 2])
    names, _, _ = naming.named(np.array([2]), np.array([4.9]), np.array([0.9]), np.zeros(1), np.zeros(1, bool))
    assert names.tolist() == ["car"]


def test_lengths_that_contradict_each_other_name_nothing():
    """As those of a track that went over from one vehicle to another."""
    naming, rows = Naming({"car": (3.0, 6.0), "lorry": (6.0, 18.0)}), 20
    one = np.ones(rows, int), np.full(rows, 0.3), np.full(rows, 10.0), np.zeros(rows, bool)
    names, mean, sigma = naming.named(one[0], np.full(rows, CAR), *one[1:])
    assert (set(names), mean[-1], sigma[-1]) == ({"car"}, pytest.approx(CAR), pytest.approx(0.3))
    names, mean, sigma = naming.named(one[0], np.full(rows, LORRY), *one[1:])
    assert (names[-1], mean[-1]) == ("unknown", pytest.approx((CAR + LORRY) / 2))
    assert sigma[-1] == pytest.approx((LORRY - CAR) / 2)


def test_without_a_length_there_is_none_and_a_vague_one_is_unknown():
    naming = Naming({})
    length, sigma = np.array([np.nan, CAR, LORRY, 5.0]), np.array([np.nan, 0.3, 0.5, 3.0])
    found, _, _ = naming.named(np.arange(4), length, sigma, np.full(4, 10.0), np.zeros(4, bool))
    assert found.tolist() == ["", "car", "lorry or bus", "unknown"]


def test_blocks_do_not_matter():
    rng = np.random.default_rng(2)
    track, length = rng.integers(0, 5, 40), rng.uniform(3, 9, 40)
    whole, parts = Naming({}), Naming({})
    rows = track, length, np.full(40, 0.4), np.full(40, 8.0), np.zeros(40, bool)
    every = np.concatenate([parts.named(*(column[k : k + 10] for column in rows))[0] for k in range(0, 40, 10)])
    alive = np.all([np.isin(np.arange(5), track[k : k + 10]) for k in (0, 10, 20)], axis=0)
    kept = alive[track]
    assert whole.named(*rows)[0][kept].tolist() == every[kept].tolist()
