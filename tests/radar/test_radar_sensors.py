"""The radar's measurement models."""

import numpy as np
import pytest

from vidtrack.radar.sensors import PositionRangeRate, RangeAzimuth, RangeAzimuthElevation

PLANE = (0, 2)
SPACE = (0, 2, 4)
SENSORS = [
    (RangeAzimuth((100.0, -50.0)), PLANE),
    (RangeAzimuth((100.0, -50.0), doppler=True), PLANE),
    (RangeAzimuthElevation((10.0, 20.0, 30.0)), SPACE),
    (RangeAzimuthElevation((10.0, 20.0, 30.0), doppler=True), SPACE),
    (PositionRangeRate((5.0, 6.0)), PLANE),
    (PositionRangeRate((5.0, 6.0, 7.0)), SPACE),
]


def states(dim, count=20):
    rng = np.random.default_rng(dim)
    scale = np.tile([10_000.0, 200.0], dim)
    return scale * rng.standard_normal((count, 2 * dim))


def test_a_target_to_the_east_that_goes_away():
    sensor = RangeAzimuth((100.0, 0.0), doppler=True)
    x = np.array([[400.0, 30.0, 0.0, 7.0]])
    assert sensor.h(x, PLANE) == pytest.approx(np.array([[300.0, np.pi / 2, 30.0]]))


def test_a_target_above_the_radar():
    sensor = RangeAzimuthElevation((0.0, 0.0, 10.0), doppler=True)
    x = np.array([[0.0, 1.0, 0.0, 2.0, 510.0, -3.0]])
    assert sensor.h(x, SPACE)[0, [0, 2, 3]] == pytest.approx([500.0, np.pi / 2, -3.0])
    assert np.isfinite(sensor.H(x, SPACE)).all()


@pytest.mark.parametrize(("sensor", "position"), SENSORS)
def test_the_jacobian_is_the_derivative(sensor, position):
    x = states(len(position))
    H = sensor.H(x, position)
    for column in range(x.shape[1]):
        step = np.zeros(x.shape[1])
        step[column] = 1e-3
        slope = (sensor.h(x + step, position) - sensor.h(x - step, position)) / 2e-3
        assert H[:, :, column] == pytest.approx(slope, rel=1e-4, abs=1e-8)


@pytest.mark.parametrize(("sensor", "position"), SENSORS)
def test_a_measurement_is_located_where_the_state_is(sensor, position):
    x = states(len(position))
    z = sensor.h(x, position)
    R = np.broadcast_to(np.diag(np.full(z.shape[1], 1e-10)), (len(z), z.shape[1], z.shape[1]))
    found, cov = sensor.locate(z, R)
    assert found == pytest.approx(x[:, position], rel=1e-6, abs=1e-3)
    assert cov.shape == (len(x), len(position), len(position))


def test_only_the_azimuth_wraps():
    assert RangeAzimuth.angles == RangeAzimuthElevation.angles == (1,)
    assert PositionRangeRate.angles == ()


def test_a_target_at_the_radar_itself_gives_numbers():
    x = np.zeros((1, 4))
    sensor = RangeAzimuth(doppler=True)
    assert np.isfinite(sensor.h(x, PLANE)).all()
    assert np.isfinite(sensor.H(x, PLANE)).all()
