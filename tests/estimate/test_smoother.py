"""The smoother against least squares over the whole batch, the textbook's recursion, and simulated truth."""

import numpy as np
import pytest

import vidtrack as vt
from vidtrack.estimate.imm import IMMBank
from vidtrack.estimate.kalman import KalmanBank
from vidtrack.estimate.smoother import smoothed, smoothing_gain
from vidtrack.estimate.unscented import UnscentedBank
from vidtrack.output.smoothed import smoothed_by

BATCH_Z = (
    7.0409191213851825, 3.1443349686858184, 6.818098846725779, 6.532230393872069, 7.347350707889554, 8.284402836910234,
    7.180013870852749, 9.668067622355808, 9.734786923725057, 14.622999516644883, 12.225786613227921, 12.347369205658405,
)  # fmt: skip


def filtered(z, F, Q, P0, R=1.0):
    """(x, P) after each scan, and (prior_x, prior_P) before; z (K, T), one measured position a row of T tracks."""
    H = np.array([[1.0, 0.0]])
    x, P = np.zeros((z.shape[1], 2)), np.tile(P0, (z.shape[1], 1, 1))
    posterior, prior = [], []
    for k in range(len(z)):
        if k:
            x, P = x @ F.T, F @ P @ F.T + Q
        prior.append((x, P))
        K = P @ H.T / (H @ P @ H.T + R)
        x = x + (K @ (z[k][:, None] - x @ H.T)[:, :, None])[:, :, 0]
        A = np.eye(2) - K @ H
        P = A @ P @ np.swapaxes(A, 1, 2) + R * K @ np.swapaxes(K, 1, 2)
        posterior.append((x, P))
    return posterior, prior


def backward(posterior, prior, F):
    """Smoothed (x, P) of all scans."""
    result = [posterior[-1]]
    for k in range(len(posterior) - 2, -1, -1):
        x, P = posterior[k]
        gain = smoothing_gain(P @ F.T, prior[k + 1][1])
        result.insert(0, smoothed(x, P, gain, *prior[k + 1], *result[0]))
    return result


def whole_batch(z, F, Q, P0, R=1.0):
    """(x, P) of all scans from one linear system: the prior, the motions and the measurements as equations."""
    K, n = len(z), 2
    rows, right = [], []

    def equation(blocks, value, cov):
        L = np.linalg.inv(np.linalg.cholesky(np.atleast_2d(cov)))
        A = np.zeros((len(L), K * n))
        for k, block in blocks:
            A[:, k * n : (k + 1) * n] = L @ block
        rows.append(A)
        right.append(L @ np.atleast_1d(value))

    equation([(0, np.eye(n))], np.zeros(n), P0)
    for k in range(K):
        equation([(k, np.array([[1.0, 0.0]]))], z[k], R)
        if k:
            equation([(k - 1, -F), (k, np.eye(n))], np.zeros(n), Q)
    A, b = np.vstack(rows), np.concatenate(right)
    cov = np.linalg.inv(A.T @ A)
    x = cov @ A.T @ b
    return [(x[k * n : (k + 1) * n], cov[k * n : (k + 1) * n, k * n : (k + 1) * n]) for k in range(K)]


def test_it_equals_least_squares_over_the_whole_batch():
    rng = np.random.default_rng(0)
    F, Q, P0 = np.array([[1.0, 0.5], [0.0, 1.0]]), np.array([[0.05, 0.08], [0.08, 0.3]]), np.diag([9.0, 4.0])
    z = rng.normal(0, 3, (15, 4)).cumsum(axis=0)
    states = backward(*filtered(z, F, Q, P0), F)
    for track in range(4):
        for (x, P), (x0, P0k) in zip(states, whole_batch(z[:, track], F, Q, P0), strict=True):
            np.testing.assert_allclose(x[track], x0, atol=1e-10)
            np.testing.assert_allclose(P[track], P0k, atol=1e-10)


def test_without_process_noise_every_state_lies_on_the_line_of_least_squares():
    """SPEC 001, `batch_vs_recursive`: the line through twelve measurements."""
    F = np.array([[1.0, 1.0], [0.0, 1.0]])
    states = backward(*filtered(np.array(BATCH_Z)[:, None], F, np.zeros((2, 2)), 1e7 * np.eye(2)), F)
    x, P = states[-1]
    np.testing.assert_allclose(x[0], [12.91108514548018, 0.7573736533004348], atol=1e-5)
    np.testing.assert_allclose(P[0], [[0.29487179487, 0.03846153846], [0.03846153846, 0.00699300699]], atol=1e-6)
    line = np.polyfit(np.arange(12.0), BATCH_Z, 1)
    for k, (x, _) in enumerate(states):
        np.testing.assert_allclose(x[0], [np.polyval(line, k), line[0]], atol=1e-5)


BANKS = {
    "kalman": KalmanBank,
    "ukf": UnscentedBank,
    "imm": lambda model: IMMBank([model, vt.ConstantVelocity(accel=5.0, speed=20.0)], [20.0, 5.0]),
}


def played(tracker, seed, scans=60, gap=()):
    """Snapshots and truth (K, T, 2) of 16 targets well apart."""
    rng = np.random.default_rng(seed)
    x, v = 5000.0 * np.stack(np.divmod(np.arange(16.0), 4), axis=1), rng.normal(0, 10, (16, 2))
    snapshots, truth = [], []
    for k in range(scans):
        v = v + rng.normal(0, 1.0, v.shape)
        x = x + v
        truth.append(x)
        z = np.empty((0, 2)) if k in gap else x + 3 * rng.normal(size=x.shape)
        snapshots.append(tracker.step(vt.Scan(float(k), z, 9 * np.eye(2))))
    return snapshots, np.array(truth)


def looked_back(snapshots):
    result = [snapshots[-1]]
    for tracks in reversed(snapshots[:-1]):
        result.insert(0, smoothed_by(tracks, result[0]))
    return result


def rms(snapshots, truth, scans=None):
    error = []
    for tracks, true in zip(snapshots, truth, strict=True):
        nearest = np.linalg.norm(true[None] - tracks.xy[:, None], axis=2).argmin(axis=1)
        error.append(np.linalg.norm(tracks.xy - true[nearest], axis=1))
    return np.sqrt(np.mean(np.concatenate([error[k] for k in scans or range(len(error))]) ** 2))


@pytest.mark.parametrize("bank", BANKS)
def test_smoothed_tracks_are_nearer_to_the_truth(bank):
    tracker = vt.Tracker(vt.ConstantVelocity(accel=1.0, speed=20.0), estimator=BANKS[bank], smooth=True)
    gap = (30, 31, 32)
    snapshots, truth = played(tracker, 5, gap=gap)
    back = looked_back(snapshots)
    assert rms(back, truth) < 0.85 * rms(snapshots, truth)
    assert rms(back, truth, gap) < 0.85 * rms(snapshots, truth, gap)
    for tracks in back:
        assert np.linalg.eigvalsh(tracks.P).min() > 0


def turning():
    """IMM filters of one target that may turn, as it is after some turning, most likely in a turn."""
    steady, turn = vt.ConstantVelocity(accel=0.5, speed=20.0), vt.CoordinatedTurn(accel=3.0, turn=0.4, speed=20.0)
    bank = IMMBank([steady, turn], [60.0, 8.0])
    tracker = vt.Tracker(steady, estimator=lambda _: bank)
    for k in range(12):
        angle = 0.35 * max(k - 5, 0)
        z = np.array([[60 * np.sin(angle) + 20 * min(k, 5), 60 * (1 - np.cos(angle))]])
        tracker.step(vt.Scan(float(k), z, 4 * np.eye(2)))
    assert len(bank) == 1
    assert bank.mode[0].min() > 0.02
    return bank


def test_the_covariance_of_mixed_modes_with_what_they_become_is_that_of_drawn_targets():
    """Targets drawn from the mixture, each moved by its linearised model after the switching."""
    bank, rng, count = turning(), np.random.default_rng(0), 400_000
    mixed, mode = bank._mixed(1.0)
    now, later = [], []
    for each, share in zip(mixed, mode[0], strict=True):
        x = rng.multivariate_normal(each.x[0], each.P[0], round(share * count))
        noise = each.model.process_noise(1.0, each.x, each.P, each.hits, each.scale)
        J = each.model.jacobian(1.0, each.x, each.model.transition(1.0, each.x))[0]
        moved = each.ahead(1.0)[0] + (x - each.x) @ J.T
        now.append(x[:, :4])
        later.append((moved + rng.multivariate_normal(np.zeros(len(noise[0])), noise[0], len(x)))[:, :4])
    drawn = np.cov(np.concatenate(now).T, np.concatenate(later).T)
    sigma = np.sqrt(np.diag(drawn))
    expected = np.block([[bank.P[0], bank.cross(1.0)[0]], [bank.cross(1.0)[0].T, bank.ahead(1.0)[1][0]]])
    np.testing.assert_allclose(drawn / np.outer(sigma, sigma), expected / np.outer(sigma, sigma), atol=0.03)
    assert np.linalg.eigvalsh(expected).min() > 0


def test_smoothed_covariances_of_mixed_modes_are_covariances():
    """With the gain of straight motion in place of that of the modes some variances were below zero."""
    steady, turn = vt.ConstantVelocity(accel=0.5, speed=300.0), vt.CoordinatedTurn(accel=30.0, turn=0.1, speed=300.0)
    rng, tracker = (
        np.random.default_rng(3),
        vt.Tracker(steady, estimator=lambda _: IMMBank([steady, turn], [500.0, 20.0]), smooth=True),
    )
    x, heading, snapshots = np.zeros(2), 0.0, []
    for k in range(60):
        heading += 0.3 if 20 <= k < 28 or 40 <= k < 46 else 0.0
        x = x + 4 * 250 * np.array([np.cos(heading), np.sin(heading)])
        snapshots.append(tracker.step(vt.Scan(4.0 * k, x + 150 * rng.normal(size=(1, 2)), 150**2 * np.eye(2))))
    least = [np.linalg.eigvalsh(tracks.P).min() for tracks in looked_back(snapshots) if len(tracks)]
    assert min(least) > 0


@pytest.mark.parametrize("method", [vt.GNN, vt.PDA, vt.JPDA, vt.Split, vt.MHT])
def test_every_method_can_be_smoothed(method):
    tracker = vt.Tracker(vt.ConstantVelocity(accel=1.0, speed=20.0), method(), smooth=True)
    snapshots, truth = played(tracker, 6)
    assert rms(looked_back(snapshots), truth) < 0.85 * rms(snapshots, truth)


def test_a_track_of_the_tracker_is_smoothed_as_the_textbook_has_it():
    """Rauch, Tung and Striebel's equations written out for the tracker's own filter."""
    model = vt.ConstantVelocity(accel=1.0, speed=20.0)
    snapshots, _ = played(vt.Tracker(model, smooth=True), 7)
    back = looked_back(snapshots)
    one = np.ones(1)
    for track in range(4):
        x, P = snapshots[-1].x[track], snapshots[-1].P[track]
        for k in range(len(snapshots) - 2, -1, -1):
            before = snapshots[k]
            F = model.transition(1.0, before.x)[0]
            Q = model.process_noise(1.0, before.x[[track]], before.P[[track]], one, one)[0]
            ahead = F @ before.P[track] @ F.T + Q
            C = before.P[track] @ F.T @ np.linalg.inv(ahead)
            x = before.x[track] + C @ (x - F @ before.x[track])
            P = before.P[track] + C @ (P - ahead) @ C.T
            np.testing.assert_allclose(back[k].x[track], x, atol=1e-10)
            np.testing.assert_allclose(back[k].P[track], P, atol=1e-10)
