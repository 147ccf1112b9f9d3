"""What is not known of biases is in the errors of tracks."""

import numpy as np
import pytest

from vidtrack.radar.coordinates import to_cartesian, to_polar
from vidtrack.radar.network.registration import Registration
from vidtrack.radar.network.untold import with_untold
from vidtrack.tracks import CONFIRMED, Tracks

PLACES = [(0.0, 15e3), (0.0, -15e3)]
PRIOR = np.array([[100.0, np.radians(1.0), 0.0], [60.0, np.radians(0.5), 0.5]])
R = np.array([np.diag([40.0**2, np.radians(0.3) ** 2])] * 2)


def tracks(rng, count=5, prior_P=None):
    """Tracks with state x, vx, y, vy, anywhere within 60 km."""
    x = np.column_stack([rng.uniform(-60e3, 60e3, count), rng.normal(0, 200, count)] * 2)
    x[:, 2:] = np.column_stack([rng.uniform(-60e3, 60e3, count), rng.normal(0, 200, count)])
    P = np.tile(np.diag([900.0, 25.0, 900.0, 25.0]), (count, 1, 1))
    zero, nothing = np.zeros(count), np.full(count, -1)
    return Tracks(
        0.0, np.arange(1, count + 1), np.full(count, CONFIRMED, np.int8), x, P, np.full((count, 4), np.nan), nothing,
        zero, zero, zero, zero + 1, nothing, zero, prior_P=prior_P,
    )  # fmt: skip


def added(found, places=PLACES, prior=PRIOR, covered=None):
    registration = Registration(places, prior, np.full(len(places), 4.0), jerk=0.1)
    covered = [np.ones(len(found))] * len(places) if covered is None else covered
    return with_untold(found, registration, covered, R[: len(places)]).P - found.P


def by_one(found, place, prior):
    """(T, 4, 4) covariance of x, vx, y, vy by the biases of one radar, from the slopes of what it would measure."""
    xy, v, origin, step = found.xy, found.v, np.array(place), 1e-3

    def measured(t, bias):
        return to_cartesian(to_polar(xy + v * (t - bias[2]) - origin) + bias[:2])

    columns = []
    for size in np.diag([1.0, 1e-4, 1e-2]):
        p = [(measured(t, size) - measured(t, -size)) / (2 * size.sum()) for t in (-step, 0.0, step)]
        slope = (p[2] - p[0]) / (2 * step)
        columns.append(np.stack([p[1][:, 0], slope[:, 0], p[1][:, 1], slope[:, 1]], axis=1))
    H = np.stack(columns, axis=2)
    return H @ np.diag(prior**2) @ H.transpose(0, 2, 1)


def test_the_biases_of_a_lone_radar_are_in_its_tracks_at_full_size():
    """Of two radars the other one does not cover these places."""
    found = tracks(np.random.default_rng(0))
    covered = [np.zeros(5), np.ones(5)]
    np.testing.assert_allclose(
        added(found, covered=covered), by_one(found, PLACES[1], PRIOR[1]), rtol=1e-3, atol=1e-2 * PRIOR[1, 0]
    )


def test_of_radars_at_one_place_each_has_half():
    found = tracks(np.random.default_rng(1))
    place, prior = [PLACES[0]] * 2, PRIOR[[0, 0]]
    np.testing.assert_allclose(
        added(found, place, prior), by_one(found, place[0], prior[0]) / 2, rtol=1e-3, atol=1e-2 * prior[0, 0]
    )


def test_a_track_at_the_place_of_a_radar_has_finite_errors():
    found = tracks(np.random.default_rng(5))
    found.x[0, [0, 2]], found.x[1, [0, 2]] = PLACES
    assert np.isfinite(added(found)).all()


def test_biases_that_are_known_add_nothing():
    found = tracks(np.random.default_rng(2))
    np.testing.assert_array_equal(added(found, prior=0 * PRIOR), 0.0)


@pytest.mark.parametrize("covered", [0.0, 1.0])
def test_covariances_stay_symmetric_and_positive(covered):
    found = tracks(np.random.default_rng(3), 50)
    P = found.P + added(found, covered=[np.full(50, covered)] * 2)
    np.testing.assert_allclose(P, P.transpose(0, 2, 1), rtol=1e-12, atol=1e-9)
    assert np.linalg.eigvalsh(P - found.P).min() > -1e-6


def test_a_smoother_does_not_add_the_biases_once_more_in_every_scan():
    found = tracks(np.random.default_rng(4), prior_P=np.tile(np.eye(4) * 1e4, (5, 1, 1)))
    registration = Registration(PLACES, PRIOR, np.full(2, 4.0), jerk=0.1)
    after = with_untold(found, registration, [np.ones(5)] * 2, R)
    np.testing.assert_allclose(after.prior_P - found.prior_P, after.P - found.P, rtol=1e-9)
