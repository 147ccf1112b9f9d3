"""One-to-one matching of crossings in time, against trying everything."""

from itertools import permutations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vidtrack.traffic.validation.event_matching import match

TIMES = st.lists(st.integers(0, 40).map(lambda tenths: tenths / 10), max_size=5)


def best_by_trying(counted, noted, certain, tolerance):
    """(certain ones found, ones found, summed difference) of the best one-to-one assignment."""
    best = (0, 0, 0.0)
    places = [*range(len(counted)), *[-1] * len(noted)]
    for chosen in set(permutations(places, len(noted))):
        pairs = [(i, j) for i, j in enumerate(chosen) if j >= 0]
        late = [abs(counted[j] - noted[i]) for i, j in pairs]
        if all(dt <= tolerance + 1e-9 for dt in late):
            score = (sum(certain[i] for i, _ in pairs), len(pairs), -sum(late))
            best = max(best, score)
    return best


@settings(max_examples=150)
@given(TIMES, TIMES.filter(lambda times: len(times) <= 4), st.data(), st.sampled_from([0.3, 1.05, 5.0]))
def test_no_assignment_is_better(counted, noted, data, tolerance):
    counted = np.sort(np.array(counted, float))
    noted = np.array(noted, float)
    certain = np.array(data.draw(st.lists(st.booleans(), min_size=len(noted), max_size=len(noted))), bool)
    found = match(counted, noted, certain, tolerance)
    hits = found >= 0
    assert len(set(found[hits])) == hits.sum()
    late = np.abs(counted[found[hits]] - noted[hits])
    assert (late <= tolerance + 1e-9).all()
    wanted = best_by_trying(counted.tolist(), noted.tolist(), certain.tolist(), tolerance)
    assert (int(certain[hits].sum()), int(hits.sum())) == wanted[:2]
    assert -late.sum() == pytest.approx(wanted[2])


def test_a_near_one_is_given_up_where_two_can_be_found():
    counted = np.array([10.0, 11.0])
    assert match(counted, np.array([10.9, 11.8]), np.array([True, True]), 1.0).tolist() == [0, 1]


def test_a_certain_one_comes_before_a_nearer_uncertain_one():
    assert match(np.array([5.0]), np.array([5.0, 5.8]), np.array([False, True]), 1.0).tolist() == [-1, 0]


def test_a_day_is_matched():
    rng = np.random.default_rng(0)
    noted = np.sort(rng.uniform(0, 86_400, 20_000))
    seen = np.sort(noted[rng.random(20_000) < 0.95] + 0.01)
    found = match(seen, noted, np.ones(20_000, bool), 0.5)
    assert (found >= 0).sum() == len(seen)


def test_nobody_matches_nobody():
    assert match(np.array([]), np.array([1.0]), np.array([True]), 1.0).tolist() == [-1]
    assert match(np.array([1.0]), np.array([]), np.array([], bool), 1.0).tolist() == []
