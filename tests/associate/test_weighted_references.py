"""Single updates against reference numbers: PDA, generalized NN, strongest neighbour, PSN, the greedy rules."""

import numpy as np
import pytest
from problems import random_problem, table

from vidtrack.amplitude.densities import detection_probability, linear
from vidtrack.associate.gate import Gate
from vidtrack.associate.generalized_nn import GeneralizedNN
from vidtrack.associate.hard import GNN, GreedyGNN
from vidtrack.associate.pda import PDA
from vidtrack.associate.problem import Problem
from vidtrack.associate.strongest import PSN, StrongestNeighbour
from vidtrack.errors import ConfigError, ScanError
from vidtrack.estimate.kalman import KalmanBank
from vidtrack.estimate.motion.velocity import ConstantVelocity
from vidtrack.estimate.sensor import POSITION
from vidtrack.scan import Scan

FOUR_SIGMA = 0.9996645373720975


def updated(method, x, P, scan, detection, clutter):
    """One row's state after the update, and its weights, with a gate of four sigma."""
    bank = KalmanBank(ConstantVelocity(dim=2))
    bank.append(np.zeros((1, 2)), np.eye(2)[None], np.ones(1))
    bank.x, bank.P = np.array([x]), np.array([P])
    zhat, cov = bank.predicted_measurement(POSITION)
    problem = Problem.gated(Gate(FOUR_SIGMA), zhat, cov, scan, detection, clutter)
    decision = method.decide(problem)
    bank.update(decision, scan, POSITION)
    return bank.x[0], bank.P[0], table(problem, decision)[0]


PDA_X = [10.0, 1.0, 5.0, -0.5]
PDA_P = [[2.0, 0.6, 0.0, 0.0], [0.6, 0.8, 0.0, 0.0], [0.0, 0.0, 2.0, 0.6], [0.0, 0.0, 0.6, 0.8]]
PDA_Z = [[10.8, 5.3], [8.9, 6.7], [12.0, 3.1]]
PDA_UPDATED = [
    [1.24449632370326, 0.37334889711097796, -0.5132649604617259, -0.15397948813851778],
    [0.373348897110978, 0.7320046691332935, -0.15397948813851775, -0.046193846441555324],
    [-0.5132649604617259, -0.15397948813851778, 1.331239556012319, 0.39937186680369563],
    [-0.15397948813851775, -0.046193846441555324, 0.3993718668036957, 0.7398115600411088],
]
PDA_INFLATED = [
    [1.2452601617254226, 0.37357804851762677, -0.5132649604617259, -0.15397948813851778],
    [0.3735780485176268, 0.7320734145552882, -0.15397948813851775, -0.046193846441555324],
    [-0.5132649604617259, -0.15397948813851778, 1.3320033940344815, 0.39960101821034444],
    [-0.15397948813851775, -0.046193846441555324, 0.3996010182103445, 0.7398803054631035],
]


@pytest.mark.parametrize(("inflate", "P"), [(False, PDA_UPDATED), (True, PDA_INFLATED)])
def test_pda_update(inflate, P):
    """SPEC 001, `pda_update`, without and with the widening of the missed branch."""
    x1, P1, weights = updated(PDA(inflate), PDA_X, PDA_P, Scan(0.0, PDA_Z, np.eye(2)), 0.8, 0.02)
    np.testing.assert_allclose(
        weights, [0.053438071993604196, 0.5013697457641859, 0.2859100290869699, 0.1592821531552401], rtol=1e-9
    )
    np.testing.assert_allclose(
        x1, [10.27010604728411, 1.0810318141852324, 5.222547921454765, -0.43323562356357037], rtol=1e-9
    )
    np.testing.assert_allclose(P1, P, rtol=1e-9)


def test_pda_of_an_empty_scan_is_the_prediction():
    x1, P1, weights = updated(PDA(), PDA_X, PDA_P, Scan(0.0, np.empty((0, 2)), np.eye(2)), 0.8, 0.02)
    np.testing.assert_array_equal(weights, [1.0])
    np.testing.assert_allclose(x1, PDA_X)
    np.testing.assert_allclose(P1, PDA_P)


def test_without_clutter_pda_believes_what_it_sees():
    _, _, weights = updated(PDA(), PDA_X, PDA_P, Scan(0.0, PDA_Z, np.eye(2)), 0.8, 0.0)
    np.testing.assert_allclose(weights, np.array([0, 0.52967, 0.30205, 0.16827]), atol=1e-5)
    assert weights[0] == 0.0


@pytest.mark.parametrize("gate", [0.0, 1.0])
@pytest.mark.parametrize("inflate", [False, True])
def test_gates_that_admit_nothing_or_everything(gate, inflate):
    problem = random_problem(np.random.default_rng(0), 5, 4, gate=gate, detection=1.0, clutter=0.1)
    decision = PDA(inflate).decide(problem)
    assert len(decision.beta) == (20 if gate else 0)
    np.testing.assert_array_equal(decision.beta0, 1.0 - gate)
    assert decision.inflation is None or (decision.inflation == 0).all()


def test_generalized_nn_weighs_by_inverse_distance():
    """SPEC 001, `generalized_nn`: 1 / d and not 1 / d2."""
    scan = Scan(0.0, [[1.0, 0.0], [0.0, 2.0], [-2.0, 2.0]], 0.5 * np.eye(2))
    problem = Problem.gated(Gate(0.999), np.zeros((1, 2)), 0.5 * np.eye(2)[None], scan)
    decision = GeneralizedNN().decide(problem)
    np.testing.assert_allclose(decision.beta, [0.5395042867796359, 0.26975214338981796, 0.19074356983054616], rtol=1e-9)
    np.testing.assert_allclose(decision.beta @ scan.z, [0.1580171471185436, 0.9209914264407282], rtol=1e-9)
    assert not decision.spread
    assert decision.beta0 == 0.0


def test_a_measurement_on_the_prediction_takes_all():
    scan = Scan(0.0, [[1.0, 0.0], [0.0, 0.0], [0.0, 0.0]], 0.5 * np.eye(2))
    problem = Problem.gated(Gate(0.999), np.zeros((1, 2)), 0.5 * np.eye(2)[None], scan)
    np.testing.assert_array_equal(GeneralizedNN().decide(problem).beta, [0.0, 0.5, 0.5])


def test_generalized_nn_updates_by_the_mean_as_by_one_measurement():
    scan = Scan(0.0, PDA_Z, np.eye(2))
    x1, P1, weights = updated(GeneralizedNN(), PDA_X, PDA_P, scan, 0.9, 1e-3)
    mean = Scan(0.0, weights[None, 1:] @ np.array(PDA_Z), np.eye(2))
    x2, P2, _ = updated(GNN(), PDA_X, PDA_P, mean, 0.9, 1e-3)
    np.testing.assert_allclose(x1, x2, rtol=1e-12)
    np.testing.assert_allclose(P1, P2, rtol=1e-12)


PSN_X = [1.0, 0.5, -2.0, 0.3]
PSN_P = [[2.0, 0.6, 0.1, 0.0], [0.6, 0.8, 0.0, 0.05], [0.1, 0.0, 1.7, 0.5], [0.0, 0.05, 0.5, 0.9]]
SNR = linear(16)
P_D = float(detection_probability(1e-3, SNR))
NEAR, FAR = [1.5, -1.2], [4.0, -5.0]
PSN_CASES = [
    (NEAR, 8.0, False, 0.9999999998715171, 1.343016069177189, 0.6662546355391541, 0.01236093946513761),
    (NEAR, 8.0, True, 0.9999999998715171, 1.343016069177189, 0.666254635540813, 0.012360939465246606),
    (NEAR, 4.0, False, 0.6173182997777945, 1.211750096648131, 1.2107654751869492, 0.08760148532794967),
    (NEAR, 4.0, True, 0.6173182997777945, 1.211750096648131, 1.210541382345822, 0.08758676041373659),
    (FAR, 5.0, False, 0.7939133882068817, 2.5574048789670227, 1.5727998401078214, -0.5633581026129982),
    (FAR, 5.0, True, 0.7939133882068817, 2.5574048789670227, 1.5740237602041054, -0.5632776800598689),
    (FAR, 12.0, False, 1.0, 2.9616810877626696, 0.6662546353522871, 0.012360939431396795),
]


@pytest.mark.parametrize(("z", "a", "printed", "p_true", "x0", "P00", "P02"), PSN_CASES)
def test_psn_update(z, a, printed, p_true, x0, P00, P02):
    """SPEC 002: 16 dB, P_FA 1e-3, resolution cells of 0.1; a weaker plot nearer by does not matter."""
    scan = Scan(0.0, [[1.1, -2.0], z], np.eye(2), amplitude=[3.8, a])
    x1, P1, weights = updated(PSN(SNR, printed=printed), PSN_X, PSN_P, scan, P_D, 1e-3 / 0.1)
    np.testing.assert_allclose(weights, [1 - p_true, 0.0, p_true], rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(x1[0], x0, rtol=1e-9)
    np.testing.assert_allclose(P1[0, [0, 2]], [P00, P02], rtol=1e-9)


def test_psn_without_a_report_widens_the_prediction():
    scan = Scan(0.0, np.empty((0, 2)), np.eye(2))
    x1, P1, _ = updated(PSN(SNR), PSN_X, PSN_P, scan, P_D, 1e-3 / 0.1)
    np.testing.assert_allclose(x1, PSN_X)
    np.testing.assert_allclose(
        P1[[0, 0, 2, 3], [0, 3, 2, 3]],
        [2.0193723251620486, 8.976981076018783e-05, 1.71555351741231, 0.9013465471614028],
        rtol=1e-9,
    )


@pytest.mark.parametrize("detection", [0.0, 0.5, 1.0])
@pytest.mark.parametrize("clutter", [0.0, 0.1])
@pytest.mark.parametrize("gate", [0.0, 0.9, 1.0])
@pytest.mark.parametrize("printed", [False, True])
def test_psn_in_its_limits(detection, clutter, gate, printed):
    problem = random_problem(
        np.random.default_rng(4), 5, 4, gate=gate, detection=detection, clutter=clutter, amplitude=True
    )
    decision = PSN(printed=printed).decide(problem)
    assert np.isfinite(decision.inflation).all()
    assert (decision.inflation >= 0).all()
    if detection == 0:
        np.testing.assert_array_equal(decision.beta, 0.0)
    elif clutter == 0:
        np.testing.assert_array_equal(decision.beta, 1.0)


def test_strongest_neighbour_takes_the_strongest_in_the_gate():
    z = [[0.1, 0.0], [1.0, 1.0], [50.0, 0.0]]
    strong = Scan(0.0, z, np.eye(2), amplitude=[2.0, 5.0, 9.0])
    sure = Scan(0.0, z, np.eye(2), score=[0.2, 0.1, 0.9])
    for scan, taken in ((strong, 1), (sure, 0)):
        problem = Problem.gated(Gate(0.99), np.zeros((1, 2)), np.eye(2)[None], scan)
        assert StrongestNeighbour().decide(problem).measurement == [taken]


def test_psn_trusts_a_high_score_more_than_a_low_one():
    weights = []
    for score in (0.0, 0.5, 1.0):
        scan = Scan(0.0, [[1.0, 0.0]], np.eye(2), score=[score])
        problem = Problem.gated(Gate(0.99), np.zeros((1, 2)), np.eye(2)[None], scan, 0.9, 0.05)
        weights.append(PSN().decide(problem).beta[0])
    assert 0 < weights[0] < weights[1] < weights[2] <= 1


@pytest.mark.parametrize("method", [StrongestNeighbour(), PSN()])
def test_a_scan_that_says_nothing_of_strength_is_refused(method):
    problem = Problem.gated(Gate(0.99), np.zeros((1, 2)), np.eye(2)[None], Scan(0.0, np.zeros((1, 2)), np.eye(2)))
    with pytest.raises(ScanError, match="neither amplitudes nor scores"):
        method.decide(problem)


def test_impossible_settings_are_refused():
    with pytest.raises(ConfigError, match="SNR"):
        PSN(snr=-1.0)
    with pytest.raises(ConfigError, match="missed-track, maximum-cardinality"):
        GNN("hungarian")
    with pytest.raises(ConfigError, match="cost, track"):
        GreedyGNN("random")
