"""Velocities filtered on the road."""

import numpy as np
import pytest

from vidtrack.traffic.pace import Pace

RATE, M_PER_PX = 25.0, 0.1


def followed(place, pace=None, begin=0.0):
    """Velocities and covariances of one track at places (N, 2)."""
    count = len(place)
    t, by_px = begin + np.arange(count) / RATE, np.tile(M_PER_PX * np.eye(2), (count, 1, 1))
    return (pace or Pace()).follow(np.full(count, 7), t, np.asarray(place, float), by_px)


def line(v, count, start=(0.0, 0.0)):
    return np.asarray(start) + np.arange(count)[:, None] / RATE * np.asarray(v)


def test_a_steady_velocity_is_found_within_its_stated_error():
    off = []
    for seed in range(60):
        noise = M_PER_PX * 1.2 * np.random.default_rng(seed).standard_normal((50, 2))
        v, cov = followed(line((12.0, -5.0), 50) + noise)
        error = v[-1] - (12.0, -5.0)
        off.append(error @ np.linalg.inv(cov[-1]) @ error)
    assert 0.1 < np.mean(off) < 2.0  # 2 if the stated errors were independent and the speed not that steady
    assert np.sqrt(np.trace(cov[-1])) < 1.0


def test_nothing_is_known_before_the_second_measurement_and_of_what_was_never_seen():
    v, cov = followed(line((9.0, 0.0), 5))
    assert np.isnan(v[0]).all()
    assert np.isinf(cov[0]).all()
    assert np.isnan(followed(np.full((5, 2), np.nan))[0]).all()


def test_it_predicts_where_a_track_is_not_seen_and_begins_anew_elsewhere():
    place = line((10.0, 0.0), 60)
    place[40:45] = np.nan
    place[50:] += [30.0, 8.0]  # another vehicle
    v, cov = followed(place)
    assert v[44] == pytest.approx([10.0, 0.0], abs=0.3)
    assert np.trace(cov[44]) > np.trace(cov[39])
    assert v[52] == pytest.approx([10.0, 0.0], abs=0.3)  # a few places that do not fit change nothing
    longer = np.vstack([place[:50], line((-6.0, 0.0), 40, (50.0, 8.0))])
    assert followed(longer)[0][-1] == pytest.approx([-6.0, 0.0], abs=0.5)


def test_blocks_of_rows_go_on_with_their_tracks():
    place, pace = line((10.0, 2.0), 60), Pace()
    whole, _ = followed(place)
    followed(place[:30], pace)
    assert followed(place[30:], pace, begin=30 / RATE)[0] == pytest.approx(whole[30:])
