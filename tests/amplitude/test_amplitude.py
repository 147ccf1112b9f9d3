import numpy as np
import pytest
import scipy  # its parts are imported when they are asked for
from hypothesis import given, settings
from hypothesis import strategies as st

from vidtrack.amplitude.densities import (
    RAYLEIGH,
    Weibull,
    detection_probability,
    false_alarm_probability,
    linear,
    log_ratio,
    swerling1,
)
from vidtrack.errors import ConfigError

LAWS = (RAYLEIGH, swerling1(10.0), Weibull(1.5, np.log(2)), Weibull(1.0, 1.0), Weibull(3.0, 0.2))


@pytest.mark.parametrize("law", LAWS)
def test_the_density_is_minus_the_derivative_of_the_survival_function(law):
    for a in (0.3, 1.0, 2.5):
        assert scipy.integrate.quad(law.pdf, a, np.inf)[0] == pytest.approx(float(law.survival(a)), rel=1e-9)


@pytest.mark.parametrize("law", LAWS)
def test_samples_follow_the_law_above_a_threshold(law):
    threshold = float(law.threshold(0.3))
    a = law.sample(np.random.default_rng(1), 20_000, above=threshold)
    assert (a > threshold).all()
    level = law.threshold(0.3 * np.array([0.9, 0.5, 0.1]))
    share = (a[:, None] > level).mean(axis=0)
    np.testing.assert_allclose(share, [0.9, 0.5, 0.1], atol=4 * np.sqrt(0.25 / len(a)))


@settings(deadline=None)
@given(st.floats(1e-12, 0.999), st.floats(0, 1e3))
def test_swerling_1_in_noise_has_the_closed_form(p_fa, snr):
    p_d = detection_probability(p_fa, snr)
    assert p_d == pytest.approx(p_fa ** (1 / (1 + snr)), rel=1e-12)
    assert false_alarm_probability(p_d, snr) == pytest.approx(p_fa, rel=1e-9)


@pytest.mark.parametrize(
    ("db", "p_fa", "b", "c", "t", "p_d"),
    [
        (16, 1e-1, 2, 0.5, 2.145966026289347, 0.9451410637212103),
        (16, 1e-5, 2, 0.5, 4.798525912188081, 0.7541941549048414),
        (16, 1e-3, 2, np.log(2), 3.156863044964429, 0.8850619489351594),
        (16, 1e-3, 1.5, np.log(2), 4.63099510117583, 0.7689333172164088),
        (16, 1e-3, 1, 1, 6.907755278982137, 0.5573206053708251),
    ],
)
def test_thresholds_and_detection_in_weibull_clutter(db, p_fa, b, c, t, p_d):
    clutter = Weibull(b, c)
    assert clutter.threshold(p_fa) == pytest.approx(t, rel=1e-12)
    assert detection_probability(p_fa, linear(db), clutter) == pytest.approx(p_d, rel=1e-9)


def test_the_ratio_of_densities_is_finite_where_the_densities_vanish():
    target = swerling1(40.0)
    threshold = float(RAYLEIGH.threshold(1e-3))
    a = np.array([threshold, 8.0, 12.0, 60.0, 400.0])
    ratio = log_ratio(a, threshold, target)
    assert np.isfinite(ratio).all()
    assert (np.diff(ratio) > 0).all()
    p_t = target.pdf(8.0) / target.survival(threshold)
    p_f = RAYLEIGH.pdf(8.0) / RAYLEIGH.survival(threshold)
    assert ratio[1] == pytest.approx(float(np.log(p_t / p_f)), rel=1e-12)


@pytest.mark.parametrize("law", [(0.0, 1.0), (np.nan, 1.0), (2.0, -1.0), (2.0, np.inf)])
def test_impossible_laws_are_refused(law):
    with pytest.raises(ConfigError, match="Weibull amplitudes"):
        Weibull(*law)


def test_a_negative_snr_is_refused():
    with pytest.raises(ConfigError, match="linear SNR"):
        swerling1(-1.0)
