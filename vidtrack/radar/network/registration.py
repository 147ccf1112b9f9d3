"""Registration: the biases of several radars in range, azimuth and time, estimated from common targets.

A plot of one radar, and a position of the same target at the same time by another, differ by their biases and by their
errors only, wherever the target is:

    y = p_q(t) - p_s(t) = J_q b_q - J_s b_s + w.

This pseudo-measurement is exact and its noise is white, because it is made of plots and not of tracks, whose errors
last and hold the biases of all radars (X. Lin, Y. Bar-Shalom, T. Kirubarajan, "Exact multisensor dynamic bias
estimation with local tracks", IEEE Trans. Aerospace and Electronic Systems 40(2), 2004; for radars that do not scan at
the same time, the same authors, "Multisensor multitarget bias estimation for general asynchronous sensors", ibid.
41(3), 2005). Radars that scan at other times are compared by interpolation between two plots of the faster one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vidtrack.arrays.types import Floats, Ints
from vidtrack.radar.coordinates import unbiased

KINDS = 3
"""Biases of a radar: range [m], azimuth [rad], time [s]."""
DRIFT, DRIFT_S = 0.1, 3600.0
"""A bias wanders by this share of its prior standard deviation in so many seconds."""
FARTHEST_D2 = 18.4
"""Squared distance beyond which two plots are not of one target: the .9999 quantile of two dimensions."""
MEAN_D2, MOST_D2 = 2.0, 12.0
"""Mean of the squared distance of two plots of one target, and the most of it that one comparison counts."""
SLACK, CONTRADICTED = 3.0, 50.0
"""A cumulative sum of squared distances less the first tells by the second that an estimate is wrong; with one that is
right it gets there once in two million comparisons."""
STATED = 100.0
"""Comparisons for which the stated errors of plots count, where comparisons tell that they are too small."""
OBSERVED = 0.5
"""A bias has been observed if its standard deviation is less than this share of what it was."""


@dataclass(frozen=True, slots=True)
class Plotted:
    """Plots of one radar that tracks have taken: rows are plots.

    radar  its number
    track  (N,) ids
    t      (N,) stated times [s]
    z      (N, 2) range [m] and azimuth [rad] as measured
    R      (N, 2, 2) covariances of their errors without bias
    xy, v  (N, 2) positions [m] and velocities [m/s] of the targets, by their tracks
    """

    radar: int
    track: Ints
    t: Floats
    z: Floats
    R: Floats
    xy: Floats
    v: Floats

    def at(self, rows: Ints) -> Plotted:
        """The plots of these rows."""
        return Plotted(
            self.radar, self.track[rows], self.t[rows], self.z[rows], self.R[rows], self.xy[rows], self.v[rows]
        )


class Registration:
    """A Kalman filter of the biases of all radars. A bias is what the radar measures too much.

    origins  (x, y) of each radar [m]
    sigma    (S, 3) prior standard deviations in range [m], azimuth [rad] and time [s]; 0: no bias
    scan_s   (S,) scan time of each radar [s]: of two radars the faster one is interpolated
    jerk     spectral density of targets' accelerations [m^2/s^3], for errors of the interpolation

    used     number of comparisons in the estimate

    An estimate that comparisons contradict came from plots of different targets, or was right until a clock or a radar
    was turned: it is given up, and the biases are learnt anew from the prior (E. S. Page, "Continuous inspection
    schemes", Biometrika 41, 1954).
    """

    def __init__(self, origins: Sequence[tuple[float, float]], sigma: Floats, scan_s: Floats, jerk: float) -> None:
        self.origins = np.asarray(origins, float)
        self.prior = np.array(sigma, float)
        self.scan_s = np.asarray(scan_s, float)
        self.jerk = jerk
        self._t: float | None = None
        self._taken: list[Plotted] = []
        self._comparisons, self._distances = STATED, STATED * MEAN_D2
        self._forget()

    def _forget(self) -> None:
        """Know the prior only."""
        self._bias = np.zeros_like(self.prior)
        self._cov = np.diag(self.prior.ravel() ** 2)
        self.used, self._contradiction = 0, 0.0

    @property
    def told(self) -> bool:
        """Whether there were as many comparisons as there are biases to tell: fewer may all be of different targets."""
        return self.used >= int(np.count_nonzero(self.prior))

    @property
    def bias(self) -> Floats:
        """(S, 3) the estimate; zero until the biases are told."""
        return self._bias if self.told else np.zeros_like(self.prior)

    @property
    def cov(self) -> Floats:
        """(3 S, 3 S) its covariance; that of the prior until the biases are told."""
        return self._cov if self.told else np.diag(self.prior.ravel() ** 2)

    def sigma(self) -> Floats:
        """(S, 3) standard deviations of the biases."""
        return np.sqrt(np.diagonal(self.cov)).reshape(-1, KINDS)

    def observed(self) -> np.ndarray:
        """(S, 3) which biases the common targets have told; those without a prior are known."""
        return (self.sigma() < OBSERVED * self.prior) | (self.prior == 0)

    def of(self, radar: int) -> tuple[Floats, Floats]:
        """Bias (3,) of a radar and its covariance (3, 3)."""
        own = slice(KINDS * radar, KINDS * (radar + 1))
        return self.bias[radar], self.cov[own, own]

    def learn(self, t: float, new: Plotted) -> None:
        """Learn from the plots of a scan at t that tracks have taken."""
        if not self.prior.any():
            return
        self._drift(t)
        parts = [part for old in self._taken if old.radar != new.radar for part in self._compare(old, new)]
        if parts:
            self._update(*(np.concatenate(values) for values in zip(*parts, strict=True)))
        keep_s = 3 * float(self.scan_s.max())
        self._taken = [old for old in self._taken if t - old.t.max(initial=-np.inf) < keep_s]
        if len(new.track):
            self._taken.append(new)

    def begin_anew(self) -> None:
        """Tracks have other ids from now on; the biases stay known."""
        self._taken = []

    def _drift(self, t: float) -> None:
        """Let the biases wander until t."""
        dt = 0.0 if self._t is None else max(t - self._t, 0.0)
        self._t = t
        self._cov = self._cov + np.diag((DRIFT * self.prior.ravel()) ** 2 * dt / DRIFT_S)

    def _compare(self, old: Plotted, new: Plotted) -> list[tuple[Floats, Floats, Floats]]:
        """y (N, 2), H (N, 2, 3 S), N (N, 2, 2) of plots of another radar that lie between two of this one."""
        found: list[tuple[Floats, Floats, Floats]] = []
        if (self.scan_s[new.radar], new.radar) > (self.scan_s[old.radar], old.radar):
            return found  # of two radars the faster one is interpolated
        for before in (each for each in self._taken if each.radar == new.radar):
            ids = np.intersect1d(np.intersect1d(before.track, new.track), old.track)
            first, last, middle = (_rows(part.track, ids) for part in (before, new, old))
            between = (before.t[first] <= old.t[middle]) & (old.t[middle] < new.t[last])
            rows = np.flatnonzero(between & self._newest(before, ids))
            if len(rows):
                found.append(self._differences(before.at(first[rows]), new.at(last[rows]), old.at(middle[rows])))
        return found

    def _newest(self, before: Plotted, track: Ints) -> np.ndarray:
        """(N,) whether `before` holds the radar's last plots of these tracks."""
        later = [old.track for old in self._taken if old.radar == before.radar and old.t.max() > before.t.max()]
        return ~np.isin(track, np.concatenate(later)) if later else np.ones(len(track), bool)

    def _differences(self, before: Plotted, after: Plotted, other: Plotted) -> tuple[Floats, Floats, Floats]:
        """y, H, N of plots `other` (N,) between plots of another radar before and after them."""
        step = after.t - before.t
        share = ((other.t - before.t) / step)[:, None]
        p0, p1, p = (self._place(plots) for plots in (before, after, other))
        y = p - (1 - share) * p0 - share * p1
        # where the target is, for all plots alike: at the places of single plots, their errors would be in y and in H,
        # and would tell what nobody can of the biases, as what is common to radars at one place
        J = derivatives(self.origins[other.radar], other.xy, other.v)
        w = share[:, :, None]
        v, both = (1 - share) * before.v + share * after.v, (1 - w) * before.R + w * after.R
        J1 = derivatives(self.origins[after.radar], other.xy, v)
        H = np.zeros((len(y), 2, self._cov.shape[0]))
        H[:, :, KINDS * other.radar : KINDS * (other.radar + 1)] = J
        H[:, :, KINDS * after.radar : KINDS * (after.radar + 1)] -= J1
        motion = self.jerk * step**3 * (share[:, 0] * (1 - share[:, 0])) ** 2 / 3
        # a plot may serve in two interpolations, with weights that sum to one: not squared, they count it once
        N = in_plane(J, other.R) + in_plane(J1, both) + motion[:, None, None] * np.eye(2)
        # of a target's S radars S - 1 differences are independent, and all S (S - 1) / 2 are used
        return y, H, N * self._radars_of(other.track)[:, None, None] / 2

    def _radars_of(self, track: Ints) -> Ints:
        """(N,) how many radars have plots of each track."""
        has = np.zeros((len(self.prior), len(track)), bool)
        for old in self._taken:
            has[old.radar] |= np.isin(track, old.track)
        return has.sum(axis=0)

    def _place(self, plots: Plotted) -> Floats:
        """(N, 2) positions of plots without the estimated biases."""
        bias = self._bias[plots.radar]
        return unbiased(plots.z - bias[:2], plots.R)[0] + plots.v * bias[2] + self.origins[plots.radar]

    def _contradict(self, d2: Floats) -> bool:
        """Whether comparisons with squared distances d2 (N,), after the earlier ones, contradict the estimate.

        Errors of plots that are larger than stated do not: the distances are compared with their mean so far.
        """
        counted = np.minimum(d2, MOST_D2)
        self._distances += counted.sum()
        self._comparisons += len(counted)
        scale = MEAN_D2 * self._comparisons / max(self._distances, MEAN_D2 * self._comparisons)
        for each in (scale * counted).tolist():
            self._contradiction = max(self._contradiction + each - SLACK, 0.0)
        return self._contradiction > CONTRADICTED

    def _update(self, y: Floats, H: Floats, N: Floats) -> None:
        """Update the biases by differences (N, 2), without those that cannot be of one target."""
        S = H @ self._cov @ H.transpose(0, 2, 1) + N
        d2 = np.einsum("ni,ni->n", y, np.linalg.solve(S, y[:, :, None])[:, :, 0])
        one = d2 < FARTHEST_D2
        if self._contradict(d2):
            self._forget()
            return
        y, H, N = y[one], H[one], N[one]
        weighted = np.linalg.solve(N, H)
        information = np.einsum("nik,nil->kl", H, weighted)
        root = np.linalg.cholesky(self._cov + np.diag(self.prior.ravel() == 0))  # what is known has no uncertainty
        root[:, self.prior.ravel() == 0] = 0.0
        self._cov = root @ np.linalg.solve(np.eye(len(root)) + root.T @ information @ root, root.T)
        self._cov = (self._cov + self._cov.T) / 2
        self._bias = self._bias + (self._cov @ np.einsum("nik,ni->k", weighted, y)).reshape(-1, KINDS)
        self.used += len(y)


def derivatives(origin: Floats, xy: Floats, v: Floats) -> Floats:
    """(N, 2, KINDS) derivatives of the positions that a radar at `origin` (2,) measures by its biases.

    xy, v  (N, 2) where the targets are [m], and their velocities [m/s]
    """
    away = xy - origin
    unit = away / np.maximum(np.linalg.norm(away, axis=1, keepdims=True), 1.0)
    return np.stack([unit, np.column_stack([away[:, 1], -away[:, 0]]), -v], axis=2)


def in_plane(J: Floats, R: Floats) -> Floats:
    """(N, 2, 2) covariances of positions with errors R (N, 2, 2) of range and azimuth; J (N, 2, KINDS) derivatives."""
    polar = J[:, :, :2]
    return polar @ R @ polar.transpose(0, 2, 1)


def _rows(ids: Ints, wanted: Ints) -> Ints:
    """Index of each wanted id."""
    order = np.argsort(ids)
    return np.asarray(order[np.searchsorted(ids, wanted, sorter=order)])
