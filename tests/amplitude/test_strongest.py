import numpy as np
import pytest
from scipy.special import gamma, gammainc

from vidtrack.amplitude.densities import Weibull, linear
from vidtrack.amplitude.strongest import Strongest
from vidtrack.errors import ConfigError

CELL = 0.1
CHECKS = [  # dB, P_FA, gate volume, I_A, P(none), P(target), P(false), corrected q, paper's q
    (16, 1e-1, 150.0, 0.8246021656837283, 3.95893065163423e-67, 0.8243255424742539, 0.17567445752574606,
     0.7805493543516986, 0.8221125567984591),
    (16, 1e-5, 150.0, 0.7539246039493137, 0.2423955100424795, 0.7536716904204325, 0.0039327995370879954,
     0.7455763718046398, 0.7516483821893829),
    (13, 1e-1, 300.0, 0.6650885829432855, 5.3732898879947776e-132, 0.6648654705794634, 0.33513452942053656,
     0.5952658821074546, 0.6630805716688867),
    (13, 1e-3, 130.0, 0.6874347476829498, 0.0766061429611113, 0.6872041390159805, 0.23618971802290817,
     0.6215014425357834, 0.6853592696802268),
]  # fmt: skip


@pytest.mark.parametrize(("db", "p_fa", "volume", "alone", "none", "target", "false", "q", "q_paper"), CHECKS)
def test_probabilities_and_factors_in_rayleigh_clutter(db, p_fa, volume, alone, none, target, false, q, q_paper):
    law, cells = Strongest(linear(db), p_fa), volume / CELL
    assert law.alone(cells) == pytest.approx(alone, rel=1e-9)
    np.testing.assert_allclose(law.priors(cells), [none, target, false], rtol=1e-9)
    assert law.factor(cells) == pytest.approx(q, rel=1e-9)
    assert law.factor_paper(cells) == pytest.approx(q_paper, rel=1e-9)


@pytest.mark.parametrize(
    ("b", "c", "alone", "q"),
    [
        (2, np.log(2), 0.8648593782403584, 0.8311749389056744),
        (1.5, np.log(2), 0.718159947743557, 0.6424055233901714),
        (1, 1.0, 0.44226866807173926, 0.2941104394521538),
    ],
)
def test_probabilities_and_factors_in_weibull_clutter(b, c, alone, q):
    law = Strongest(39.81, 1e-3, Weibull(b, c))
    assert law.alone(200.0 / CELL) == pytest.approx(alone, rel=1e-9)
    assert law.factor(200.0 / CELL) == pytest.approx(q, rel=1e-9)


@pytest.mark.parametrize("p_fa", [0.5, 1e-2, 1e-6])
@pytest.mark.parametrize("cells", [0.5, 30.0, 1e5])
def test_in_noise_the_integral_has_a_closed_form(p_fa, cells):
    snr, k = 20.0, 1 / 21.0
    closed = cells**-k * gamma(1 + k) * gammainc(k, p_fa * cells)
    assert Strongest(snr, p_fa).alone(cells) == pytest.approx(closed, rel=1e-9)


def test_simulation_of_the_corrected_factor():
    """E[P_T^2 v' S^-1 v] / 2 with the filter's own posterior, from equations (12), (13) and (25)."""
    rng, runs, cells = np.random.default_rng(3), 200_000, 1500.0
    law = Strongest(linear(16), 1e-3)
    share = rng.exponential(size=runs) / cells
    false = np.where(share < law.p_fa, law.clutter.threshold(np.minimum(share, 1)), 0)
    seen = rng.random(runs) < law.p_d
    threshold = float(law.clutter.threshold(law.p_fa))
    v = rng.standard_normal((runs, 2))
    seen &= (v**2).sum(axis=1) < 16
    echo = np.where(seen, law.target.sample(rng, runs, above=threshold), 0)
    a = np.maximum(echo, false)
    radius2 = np.where(echo > false, (v**2).sum(axis=1), 16 * rng.random(runs))[a > 0]
    a = a[a > 0]
    target = np.exp(-radius2 / 2) / (2 * np.pi) * law.target.pdf(a)
    clutter = cells / (16 * np.pi) * law.clutter.pdf(a) * (1 - 0.999664537372 * law.target.survival(a))
    sample = np.zeros(runs)
    sample[: len(a)] = (target / (target + clutter)) ** 2 * radius2 / 2
    assert abs(sample.mean() - law.factor(cells)) < 4 * sample.std() / np.sqrt(runs)


@pytest.mark.parametrize("dim", [1, 2, 3])
def test_the_printed_prediction_is_a_lower_bound_of_the_error(dim):
    for cells in (0.01, 1.0, 100.0, 1e6):
        law = Strongest(20.0, 1e-2, dim=dim)
        assert 0 < law.factor(cells) <= law.factor_paper(cells) * (1 + 1e-12) < 1


def test_a_lower_threshold_never_tells_less():
    q = [Strongest(20.0, p_fa).factor(1000.0) for p_fa in (1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 1e-1, 1.0)]
    assert (np.diff(q) > -1e-12).all()


def test_impossible_settings_are_refused():
    with pytest.raises(ConfigError, match="P_FA is 2"):
        Strongest(10.0, 2.0)
    with pytest.raises(ConfigError, match="gate of 0"):
        Strongest(10.0, 0.1, gate=0.0)
