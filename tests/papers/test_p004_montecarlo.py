import csv

import numpy as np
import pytest
from click.testing import CliRunner

from vidtrack.associate.gate import Gate
from vidtrack.associate.hard import GNN
from vidtrack.cli.reproduce import command
from vidtrack.estimate.motion.velocity import ConstantVelocity
from vidtrack.papers.p004 import montecarlo, reference
from vidtrack.papers.p004.montecarlo import OTHERS, PAIRS, difference, measure
from vidtrack.papers.p004.scenarios import crossing, nine, shares, wrong_identities
from vidtrack.papers.p004.simulated import Targets, drive, nearest_target, track, two_points

RUNS = 2000


@pytest.fixture(scope="module")
def table():
    *_, (table, _) = measure(RUNS, 1, PAIRS)
    assert {outcome.runs for outcome in table.values()} == {RUNS}
    return {scenario: outcome.shares for scenario, outcome in table.items()}


@pytest.mark.parametrize("scenario", reference.CROSSING)
@pytest.mark.parametrize("pair", PAIRS)
def test_shares_agree_with_the_reference_within_four_standard_errors(table, scenario, pair):
    theirs = np.array(reference.CROSSING[scenario][pair])
    assert table[scenario][pair].sum() == pytest.approx(1)
    assert np.abs(difference(table[scenario][pair], RUNS, theirs)).max() < 4


def test_a_stopped_run_leaves_its_last_batch(tmp_path, monkeypatch):
    def stopped(targets, method, distance):
        if len(done) == 2 * len(PAIRS + OTHERS) + 3:
            raise KeyboardInterrupt
        done.append(method)
        return shares(targets, method, distance)

    done: list[str] = []
    monkeypatch.setattr(montecarlo, "BATCH", 20)
    monkeypatch.setattr(montecarlo, "shares", stopped)
    result = CliRunner().invoke(command, ["004-montecarlo", "--runs", "100", "-o", str(tmp_path / "out")])
    assert result.exit_code != 0
    assert "004-montecarlo up to here is in" in result.stderr
    rows = list(csv.DictReader((tmp_path / "out" / "004-montecarlo.csv").open()))
    assert {(row["scenario"], row["runs"]) for row in rows} == {(next(iter(reference.CROSSING)), "40")}
    assert {path.suffix for path in (tmp_path / "out").iterdir()} == {".csv", ".png"}


def test_batches_change_nothing(monkeypatch):
    *_, (whole, wrong) = measure(90, 7, PAIRS)
    monkeypatch.setattr(montecarlo, "BATCH", 40)
    *_, (table, counts) = measure(90, 7, PAIRS)
    for scenario, outcome in whole.items():
        for pair, ours in outcome.shares.items():
            np.testing.assert_allclose(table[scenario].shares[pair], ours)
    for pair, count in wrong.items():
        np.testing.assert_array_equal(counts[pair], count)


def test_with_isotropic_noise_the_confidence_region_is_the_minimum_distance_exactly():
    targets = crossing(300, 0.0, True, np.random.default_rng(2))
    isotropic = ConstantVelocity(accel=0.8)
    near = track(targets, isotropic, GNN(), Gate(distance="euclidean", radius=np.inf))
    region = track(targets, isotropic, GNN(), Gate(1.0, "mahalanobis"))
    np.testing.assert_array_equal(near, region)
    assert (shares(targets, "gnn", "euclidean", isotropic) != [1, 0, 0, 0]).any()


def test_runs_do_not_meet():
    rng = np.random.default_rng(3)
    targets = crossing(50, 0.0, True, rng)
    own = targets.run == 7
    alone = Targets(targets.truth[:, own], targets.z[:, own], np.zeros(2, np.int64), targets.seen[:, own])
    model = ConstantVelocity(accel=0.8, cross=0.2, heading=0.0)
    together = track(targets, model, GNN(), Gate(0.9999))
    np.testing.assert_array_equal(together[:, own], track(alone, model, GNN(), Gate(0.9999)))


def test_the_region_loses_fewer_of_nine_and_exclusivity_matters_more():
    targets = nine(60, np.random.default_rng(4))
    wrong = {pair: wrong_identities(targets, *pair).mean() for pair in PAIRS}
    assert wrong["gnn", "mahalanobis"] < wrong["nn", "mahalanobis"] < wrong["nn", "euclidean"]
    assert wrong["gnn", "euclidean"] < wrong["nn", "mahalanobis"]


def test_deferred_decisions_lose_fewer_crossings():
    targets = crossing(200, 0.0, True, np.random.default_rng(5))
    correct = {method: shares(targets, method, "mahalanobis")[0] for method in ("nn", "gnn", "split", "mht")}
    assert correct["nn"] < correct["split"]
    assert correct["gnn"] < correct["mht"] >= 0.99


def test_two_points_give_position_and_velocity():
    x, P = two_points(np.array([[1.0, 2.0]]), np.array([[3.0, 1.0]]))
    np.testing.assert_allclose(x, [[3, 2, 1, -1]])
    np.testing.assert_allclose(P[0, :2, :2], 0.49 * np.array([[1, 1], [1, 2]]))
    np.testing.assert_allclose(P[0, :2, 2:], 0)


def test_without_noise_targets_go_straight():
    path = drive(np.zeros((1, 2)), np.array([np.pi / 2]), 5, 2.0, 0.0, 0.0, np.random.default_rng(0))
    np.testing.assert_allclose(path[:, 0], np.stack([np.zeros(5), 2.0 * np.arange(5)], axis=1), atol=1e-12)


def test_nearest_target_looks_in_its_own_run():
    truth = np.array([[0.0, 0], [10, 0], [100, 0], [110, 0]])
    target, away = nearest_target(np.array([[9.0, 0], [1, 0], [101, 0], [99, 0]]), truth, np.array([0, 0, 1, 1]))
    np.testing.assert_array_equal(target, [[1, 0], [0, 0]])
    np.testing.assert_allclose(away, 1.0)
