import numpy as np
import pytest

from vidtrack.amplitude.cfar import (
    ca_detection_probability,
    ca_factor,
    ca_threshold,
    os_detection_probability,
    os_factor,
    os_threshold,
)
from vidtrack.errors import ConfigError


@pytest.mark.parametrize(
    ("cells", "p_fa", "alpha", "p_d"),
    [
        (8, 1e-2, 6.226235280311382, 0.5787442111808064),
        (8, 1e-6, 36.98730601522793, 0.06038570185539418),
        (16, 1e-4, 12.452470560622764, 0.3349448619752939),
        (32, 1e-6, 17.277648833903747, 0.21580849024808071),
    ],
)
def test_cell_averaging_factor_and_detection(cells, p_fa, alpha, p_d):
    assert ca_factor(p_fa, cells) == pytest.approx(alpha, rel=1e-9)
    assert ca_detection_probability(p_fa, 10.0, cells) == pytest.approx(p_d, rel=1e-9)
    assert ca_detection_probability(p_fa, 0.0, cells) == pytest.approx(p_fa, rel=1e-9)


def test_ordered_statistic_factor_gives_its_false_alarm_probability():
    factor = os_factor(1e-4, 16, 12)
    i = np.arange(12)
    assert np.prod((16 - i) / (16 - i + factor)) == pytest.approx(1e-4, rel=1e-9)
    assert os_detection_probability(1e-4, 0.0, 16, 12) == pytest.approx(1e-4, rel=1e-9)
    assert os_detection_probability(1e-4, 10.0, 16, 12) < ca_detection_probability(1e-4, 10.0, 16)


@pytest.mark.parametrize("threshold", [ca_threshold, os_threshold])
def test_false_alarms_come_at_their_rate_everywhere_and_at_any_noise_level(threshold):
    power = (
        np.random.default_rng(2).exponential(size=(3000, 40)) * np.array([1.0, 100.0, 1e6])[np.arange(3000) % 3, None]
    )
    alarms = power > threshold(power, 0.05)
    spread = 4 * np.sqrt(0.05 * 0.95 / len(power))
    np.testing.assert_allclose(alarms.mean(axis=0), 0.05, atol=1.2 * spread)


def test_reference_cells_are_the_nearest_beyond_the_guard():
    power = np.arange(1.0, 12.0)[None].repeat(2, axis=0)
    mean = ca_threshold(power, 0.01, cells=4, guard=1) / float(ca_factor(0.01, 4))
    np.testing.assert_allclose(mean[1, 5], np.mean([3, 4, 8, 9]))
    np.testing.assert_allclose(mean[0, 0], np.mean([3, 4, 5, 6]))
    np.testing.assert_allclose(mean[0, -2], np.mean([8, 7, 6, 5]))
    middle = os_threshold(power, 0.01, cells=4, rank=2, guard=1) / os_factor(0.01, 4, 2)
    np.testing.assert_allclose(middle[0, 5], 4)


def test_a_neighbouring_target_raises_the_mean_but_not_the_ordered_statistic():
    power = np.full(64, 1.0)
    power[30], power[35] = 200.0, 1000.0
    assert power[30] < ca_threshold(power, 1e-3)[30]
    assert power[30] > os_threshold(power, 1e-3)[30]


def test_arrays_too_short_and_odd_windows_are_refused():
    with pytest.raises(ConfigError, match="too few"):
        ca_threshold(np.ones(20), 1e-3, cells=16, guard=2)
    with pytest.raises(ConfigError, match="even number"):
        ca_threshold(np.ones(40), 1e-3, cells=15)
    with pytest.raises(ConfigError, match=r"1\.\.16"):
        os_threshold(np.ones(40), 1e-3, rank=17)
