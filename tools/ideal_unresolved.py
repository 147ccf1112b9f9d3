"""What NEES an ideal filter has before and while two targets share plots: what is above or below 2 is the scenario's.

    python tools/ideal_unresolved.py radar-unresolved --seeds 300-319
    python tools/ideal_unresolved.py radar-unresolved --seeds 300-319 --quiet-s 60 --manoeuvre-s 35

It believes of motion what `vidtrack radar` does by default (nearly constant velocity, with little or much
acceleration), and is told what a tracker has to find out: which plot is whose, when the targets are not resolved, and
the size of the cell. Samples of the modes of each target and, in the stretch, of their difference make it exact but for
their number; the rest is a Kalman filter for each sample (Rao-Blackwellised). A shared plot is anywhere between its
targets.
Scenarios and seeds are those of measure_unresolved.py, whose figures these are to be held against.
"""

from __future__ import annotations

import argparse
import sys
from typing import NamedTuple

import measure_unresolved as tracked
import numpy as np

from vidtrack.config.radar import RadarSettings
from vidtrack.radar.coordinates import unbiased, wrap
from vidtrack.simulate.radar import Seen
from vidtrack.simulate.radar_scenarios import simulate_radar

MODES, SAMPLES = 400, 20_000
"""Samples of a target's modes, and of a pair."""
OWN = 4.0
"""Standard deviations within which a plot is a target's."""
H = np.array([[1.0, 0, 0, 0], [0, 0, 1.0, 0]])


class Believed(NamedTuple):
    """Mean times of the quiet and the other mode [s], and the power of the acceleration in each [m^2/s^3]."""

    last_s: tuple[float, float]
    power: np.ndarray

    def modes(self, count: int, rng: np.random.Generator) -> np.ndarray:
        """Modes of `count` targets: whether they manoeuvre."""
        return rng.random(count) < self.last_s[1] / sum(self.last_s)

    def later(self, busy: np.ndarray, dt: float, rng: np.random.Generator) -> np.ndarray:
        """The modes after dt seconds."""
        changed = rng.random(busy.shape) < dt / np.where(busy, self.last_s[1], self.last_s[0])
        return busy ^ changed


class Samples(NamedTuple):
    """A target at the end of a stretch: weights, modes, states [x, vx, y, vy] and covariances of samples."""

    weight: np.ndarray
    busy: np.ndarray
    x: np.ndarray
    P: np.ndarray


def motion(dt: float) -> tuple[np.ndarray, np.ndarray]:
    """Transition (4, 4), and covariance of the process noise of power 1."""
    F, Q = np.array([[1, dt], [0, 1]]), np.array([[dt**3 / 3, dt**2 / 2], [dt**2 / 2, dt]])
    return np.kron(np.eye(2), F), np.kron(np.eye(2), Q)


def plot_near(seen: Seen, scan: int, place: np.ndarray, widest: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
    """Position (2,) and covariance of the plot of a scan nearest to a place (3,), if within OWN of these deviations."""
    plots = seen.z[seen.scan == scan]
    off = plots - seen.radar.measures(place[None])
    off[:, 1] = np.degrees(wrap(np.radians(off[:, 1])))
    apart = np.linalg.norm(off / widest, axis=1)
    if not len(plots) or apart.min() > OWN:
        return None
    r, azimuth = plots[apart.argmin()]
    sigma = np.array([seen.radar.sigma[0], np.radians(seen.radar.sigma[1])])
    z, R = unbiased(np.array([[r, np.radians(azimuth)]]), np.diag(sigma**2)[None])
    return z[0], R[0]


def drawn(weight: np.ndarray, count: int, rng: np.random.Generator) -> np.ndarray:
    """Numbers of `count` samples, drawn systematically by their weights."""
    return np.searchsorted(np.cumsum(weight), (rng.random() + np.arange(count)) / count).clip(0, len(weight) - 1)


def alone(
    seen: Seen, target: int, scans: int, believed: Believed, rng: np.random.Generator
) -> tuple[list[float], Samples]:
    """NEES of a resolved target's positions in the first scans, from its third plot on, and its state at their end."""
    dt = seen.radar.scan_s
    F, Q = motion(dt)
    busy, log_w = believed.modes(MODES, rng), np.zeros(MODES)
    x, P = np.zeros((MODES, 4)), np.diag([1e10, 4e4, 1e10, 4e4])[None].repeat(MODES, axis=0)
    found, plots = [], 0
    for scan in range(scans):
        busy = believed.later(busy, dt, rng)
        x, P = x @ F.T, F @ P @ F.T + believed.power[busy.astype(int)][:, None, None] * Q
        own = plot_near(seen, scan, seen.states[target, scan, :3], np.array(seen.radar.sigma))
        if own is not None:
            x, P, log_l = updated(x, P, own[0], own[1][None])
            log_w, plots = log_w + log_l, plots + 1
        weight = np.exp(log_w - log_w.max())
        weight /= weight.sum()
        if plots > 2:
            found.append(error(weight, x @ H.T, H @ P @ H.T, seen.states[target, scan, :2]))
        if 1 / (weight**2).sum() < MODES / 2:
            kept = drawn(weight, MODES, rng)
            busy, x, P, log_w = busy[kept], x[kept], P[kept], np.zeros(MODES)
    return found, Samples(weight, busy, x, P)


def updated(x: np.ndarray, P: np.ndarray, z: np.ndarray, R: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """States and covariances (N, ...) after a position, and ln of its densities (N,) but for a constant."""
    S, v = H @ P @ H.T + R, z - x @ H.T
    K = np.linalg.solve(S, H @ P).transpose(0, 2, 1)
    log_l = -0.5 * (np.einsum("ni,ni->n", v, np.linalg.solve(S, v[..., None])[..., 0]) + np.linalg.slogdet(S)[1])
    return x + np.einsum("nij,nj->ni", K, v), P - K @ H @ P, log_l


def error(weight: np.ndarray, place: np.ndarray, cov: np.ndarray, true: np.ndarray) -> float:
    """NEES of the mean of weighted places (N, 2) with covariances (N or 1, 2, 2)."""
    mean = weight @ place
    P = np.einsum("n,nij->ij", weight, cov) + np.einsum("n,ni,nj->ij", weight, place - mean, place - mean)
    return float((true - mean) @ np.linalg.solve(P, true - mean))


def together(
    seen: Seen, first: int, last: int, pair: list[Samples], believed: Believed, rng: np.random.Generator
) -> list[float]:
    """NEES of positions of two targets from the first to the last scan with one plot; which is which does not count."""
    dt, cell = seen.radar.scan_s, np.array([seen.radar.cell[0], np.radians(seen.radar.cell[1])])
    F, Q = motion(dt)
    root = np.linalg.cholesky(Q)
    own = [drawn(one.weight, SAMPLES, rng) for one in pair]
    own[1] = rng.permutation(own[1])
    busy = np.stack([one.busy[k] for one, k in zip(pair, own, strict=True)], axis=1)
    x = [one.x[k] for one, k in zip(pair, own, strict=True)]
    P = [one.P[k] for one, k in zip(pair, own, strict=True)]
    total = P[0] + P[1]
    d = x[0] - x[1] + np.einsum("nij,nj->ni", np.linalg.cholesky(total), rng.normal(size=(SAMPLES, 4)))
    gain = np.linalg.solve(total, (P[0] - P[1]) / 2).transpose(0, 2, 1)  # of the middle, given the difference
    middle = (x[0] + x[1]) / 2 + np.einsum("nij,nj->ni", gain, d - (x[0] - x[1]))
    P_middle = total / 4 - gain @ total @ gain.transpose(0, 2, 1)
    found: list[float] = []
    for scan in range(first, last + 1):
        busy = believed.later(busy, dt, rng)
        power = believed.power[busy.astype(int)]
        both, bias = power.sum(axis=1), (power[:, 0] - power[:, 1]) / (2 * power.sum(axis=1))
        noise = np.sqrt(both)[:, None] * (rng.normal(size=(SAMPLES, 4)) @ root.T)
        d, middle = d @ F.T + noise, middle @ F.T + bias[:, None] * noise
        P_middle = F @ P_middle @ F.T + (power.prod(axis=1) / both)[:, None, None] * Q
        states, shared = seen.states[:, scan], seen.merged[0, scan]
        line = states[:, :2].mean(axis=0)
        r = float(np.linalg.norm(line))
        axes = np.array([[line[0], line[1]], [line[1], -line[0]]]) / r
        apart = d[:, ::2] @ axes.T
        inside = (np.abs(apart) < cell * [1, r]).all(axis=1)
        log_w = np.where(inside == shared, 0.0, -np.inf)
        if shared:
            widest = np.hypot(seen.radar.sigma, np.array(seen.radar.cell) / 4)
            plot = plot_near(seen, scan, states[:, :3].mean(axis=0), widest)
            if plot is not None:
                R = plot[1] + np.einsum("ni,nj->nij", d[:, ::2], d[:, ::2]) / 12
                middle, P_middle, log_l = updated(middle, P_middle, plot[0], R)
                log_w = log_w + log_l
        if not np.isfinite(log_w).any():
            return found
        kept = drawn(np.exp(log_w - log_w.max()) / np.exp(log_w - log_w.max()).sum(), SAMPLES, rng)
        busy, d, middle, P_middle = busy[kept], d[kept], middle[kept], P_middle[kept]
        even = np.full(SAMPLES, 1 / SAMPLES)
        own_nees = [
            [error(even, (middle + side * d / 2) @ H.T, H @ P_middle @ H.T, states[k, :2]) for k in (0, 1)]
            for side in (1, -1)
        ]
        found.append(min((own_nees[0][0] + own_nees[1][1]) / 2, (own_nees[0][1] + own_nees[1][0]) / 2))
    return found


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenario", choices=["radar-unresolved", "anywhere", "straight"])
    parser.add_argument("--seeds", default="300-319", metavar="FIRST-LAST")
    usual = RadarSettings()
    parser.add_argument("--quiet-s", type=float, default=usual.quiet_s)
    parser.add_argument("--manoeuvre-s", type=float, default=usual.manoeuvre_s)
    options = parser.parse_args()
    tracked.add_scenarios()
    power = 2 * usual.hold_s * np.array([usual.quiet_accel, usual.accel]) ** 2
    believed = Believed((options.quiet_s, options.manoeuvre_s), power)
    parts: tuple[list[float], list[float]] = [], []
    first_seed, last_seed = map(int, options.seeds.split("-"))
    for seed in range(first_seed, last_seed + 1):
        rng = np.random.default_rng(seed)
        seen = simulate_radar(options.scenario, seed)
        shared = np.flatnonzero(seen.merged[0])
        first, last = int(shared[0]), int(shared[-1])
        before = [alone(seen, target, first, believed, rng) for target in (0, 1)]
        parts[0].append(float(np.mean([each for found, _ in before for each in found])))
        parts[1].append(float(np.mean(together(seen, first, last, [end for _, end in before], believed, rng))))
    for name, found in zip(tracked.PARTS, parts, strict=False):
        sys.stdout.write(f"{name}: NEES {np.nanmean(found):.2f} +- {np.nanstd(found) / len(found) ** 0.5:.2f}\n")


if __name__ == "__main__":
    main()
