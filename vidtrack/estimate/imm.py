"""Interacting multiple models: one bank per motion model, and the probability of each model."""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from dataclasses import replace
from typing import NamedTuple, Self

import numpy as np
from scipy.special import logsumexp

from vidtrack.arrays.rows import replaced
from vidtrack.arrays.types import Floats, Ints
from vidtrack.decision import Decision
from vidtrack.errors import ConfigError
from vidtrack.estimate.bank import Modes
from vidtrack.estimate.kalman import KalmanBank
from vidtrack.estimate.motion.model import Motion
from vidtrack.estimate.sensor import Sensor, wrapped
from vidtrack.scan import Scan

LEAST = 1e-9
"""Smallest probability of a mode, so that every mode can recover."""

USUAL = 2 / 3
"""Share of the usual probabilities in those of modes that nothing shows."""


class _Mixed(NamedTuple):
    """The banks as they are for each mode dt seconds later, and the modes' probabilities (T, r) then, from of_x."""

    dt: float
    of_x: Floats
    banks: tuple[KalmanBank, ...]
    mode: Floats


class IMMBank:
    """IMM filters, one per row (Blom and Bar-Shalom 1988).

    models  motion models, the first the usual one; all have the same dim
    stay_s  mean sojourn time [s] of each model; it is left for each other model alike
    rates   (r, r) instead of stay_s: rates [1/s] of switching from the model of a row to that of a column
    prior   (r,) probabilities of the models for new targets; None: in proportion to the sojourn times
    kinds   (r,) number of the kind of target that each model is of; None: all are of one
    heed    (r,) factors on the models' probabilities where measurements are gated and weighed; None: all are 1

    Models may have components beyond position and velocity. In the mixing, a component that the other model lacks
    keeps its own moments. x (T, n), P (T, n, n) are moments of position and velocity; mode (T, r) probabilities.
    """

    STATE = ("banks", "mode", "hits", "scale", "x", "P")

    def __init__(
        self,
        models: Sequence[Motion],
        stay_s: Sequence[float] | None = None,
        *,
        rates: Floats | None = None,
        prior: Floats | None = None,
        kinds: Sequence[int] | None = None,
        heed: Sequence[float] | None = None,
    ) -> None:
        r = len(models)
        if r < 2 or (stay_s is not None and len(stay_s) != r):
            stays = "" if stay_s is None else f", {len(stay_s)} stays"
            raise ConfigError(f"IMM: {r} models{stays}; give two models or more, a stay each")
        if len({model.dim for model in models}) > 1:
            raise ConfigError("IMM: the models move in different numbers of dimensions")
        if stay_s is not None and not min(stay_s) > 0:
            raise ConfigError(f"IMM: a model stays {min(stay_s):g} s; it must be above zero")
        if (rates is None) == (stay_s is None):
            raise ConfigError("IMM: give either stay_s or rates")
        if stay_s is not None:
            rates = np.repeat(1 / np.asarray(stay_s, float)[:, None] / (r - 1), r, axis=1)
        self.rates = np.array(rates, float)
        if self.rates.shape != (r, r) or not self.rates.min() >= 0:
            raise ConfigError(f"IMM: rates must be ({r}, {r}), none below zero")
        np.fill_diagonal(self.rates, 0.0)
        self.left = self.rates.sum(axis=1, keepdims=True)
        if not self.left.min() > 0:
            raise ConfigError("IMM: a model is never left; each needs a rate above zero")
        self.prior = 1 / self.left[:, 0] if prior is None else np.asarray(prior, float)
        self.prior = self.prior / self.prior.sum()
        kind = np.zeros(r) if kinds is None else np.asarray(kinds)
        together = (kind == kind[:, None]).astype(float)
        evenly, usual = (each / each.sum(axis=1, keepdims=True) for each in (together, together / self.left.T))
        self._unseen = USUAL * usual + (1 - USUAL) * evenly
        self.heed = np.ones(r) if heed is None else np.asarray(heed, float)
        if self.heed.shape != (r,) or not self.heed.min() > 0:
            raise ConfigError(f"IMM: heed must be {r} factors above zero")
        self.model = models[0]
        self.banks = tuple(KalmanBank(model) for model in models)
        self.mode = np.empty((0, r))
        self.hits = np.empty(0, np.int64)
        self.scale = np.empty(0)
        self._known: _Mixed | None = None
        self.x, self.P = self._moments(self.banks, self.mode)

    def __len__(self) -> int:
        return len(self.x)

    def ahead(self, dt: float) -> tuple[Floats, Floats]:
        return self._moments(*self._moved(dt))

    def cross(self, dt: float) -> Floats:
        """(T, n, n) over all modes: within each, as it moves after the mixing, and between their means."""
        banks, mode = self._mixed(dt)
        n = 2 * self.model.dim
        now, later = np.stack([b.x[:, :n] for b in banks]), np.stack([b.ahead(dt)[0][:, :n] for b in banks])
        within = np.stack([b.cross(dt)[:, :n, :n] for b in banks])
        off = now - self.x  # whose mean is zero: the mixing keeps x
        return np.einsum("jt,jtik->tik", mode.T, within) + np.einsum("jt,jti,jtk->tik", mode.T, off, later)

    def predict(self, dt: float) -> None:
        """Mix the modes and predict all rows by dt seconds."""
        self.banks, self.mode = self._moved(dt)
        self.x, self.P = self._moments(self.banks, self.mode)

    def predicted_measurement(self, sensor: Sensor) -> tuple[Floats, Floats]:
        """zhat (T, m) and its covariance (T, m, m) over all modes; the innovation covariance is that plus R."""
        zhat, cov = self._each(sensor)
        off = np.stack([wrapped(mean - zhat[0], sensor.angles) for mean in zhat])
        mean, over_all = _mixture(self.mode.T, off, cov)
        return wrapped(zhat[0] + mean, sensor.angles), over_all

    def modes(self, sensor: Sensor) -> Modes:
        """The predicted measurement of each mode, by which a measurement is gated and weighed."""
        heeded = self.mode * self.heed
        return Modes((heeded / heeded.sum(axis=1, keepdims=True)).T, *self._each(sensor))

    def update(self, decision: Decision, scan: Scan, sensor: Sensor) -> None:
        """Update each mode with its own weights, and the probabilities of the modes.

        P(mode, measurement) = beta P(mode) N_mode / sum over modes of P(mode) N_mode; a miss leaves P(mode) unchanged.
        """
        parent, row = decision.parent, decision.row
        before = self.mode[parent].T
        share = np.empty((len(self.banks), len(row)))
        for j, bank in enumerate(self.banks):
            zhat, cov = bank.predicted_measurement(sensor)
            v = wrapped(scan.z[decision.measurement] - zhat[parent[row]], sensor.angles)
            share[j] = np.log(before[j, row]) + _log_normal(v, cov[parent[row]] + scan.R[decision.measurement])
        share = decision.beta * np.exp(share - logsumexp(share, axis=0))
        missed = decision.beta0 * before
        mode = missed + np.stack([np.bincount(row, each, len(parent)) for each in share])
        mode = np.maximum(mode, LEAST)
        for j, bank in enumerate(self.banks):
            own = replace(decision, beta=share[j] / mode[j, row], beta0=missed[j] / mode[j])
            bank.update(own, scan, sensor)
        self.mode = (mode / mode.sum(axis=0)).T
        self.hits = self.hits[parent] + decision.hit
        self.scale = self.scale[parent]
        self.x, self.P = self._moments(self.banks, self.mode)

    def forget(self, rows: Ints) -> None:
        """Nothing shows in which of the modes that it may switch to a target of these rows is, but its kind does show.

        Their probabilities are between the usual ones, in proportion to the sojourn times, and equal ones. With equal
        ones two targets that have flown together seem to part all the time; with the usual ones which is which
        afterwards seems to be known.
        """
        self.mode[rows] = self.mode[rows] @ self._unseen
        self.x, self.P = self._moments(self.banks, self.mode)

    def append(self, position: Floats, cov: Floats, scale: Floats) -> None:
        for bank in self.banks:
            bank.append(position, cov, scale)
        self._enter(len(position), scale)

    def insert(self, x: Floats, P: Floats, scale: Floats) -> None:
        """New rows with known moments x (B, n), P (B, n, n) of position and velocity; scale (B,)."""
        shared, position = 2 * self.model.dim, list(self.model.position)
        for bank in self.banks:
            x1, P1 = bank.model.birth(x[:, position], P[:, position][:, :, position], scale)
            x1[:, :shared], P1[:, :shared, :shared] = x[:, :shared], P[:, :shared, :shared]
            bank.insert(x1, P1, scale)
        self._enter(len(x), scale)

    def keep(self, rows: np.ndarray) -> None:
        for bank in self.banks:
            bank.keep(rows)
        self.mode, self.hits, self.scale = self.mode[rows], self.hits[rows], self.scale[rows]
        self.x, self.P = self.x[rows], self.P[rows]

    def only(self, rows: Ints) -> Self:
        """A bank of its own of these rows (K,)."""
        bank = copy(self)
        bank.banks = tuple(copy(each) for each in self.banks)
        bank.keep(rows)
        return bank

    def put(self, rows: Ints, other: Self, at: Ints) -> None:
        """Set these rows (K,) to rows `at` (K,) of another bank."""
        for bank, theirs in zip(self.banks, other.banks, strict=True):
            bank.put(rows, theirs, at)
        for name in ("mode", "hits", "scale", "x", "P"):
            setattr(self, name, replaced(getattr(self, name), rows, getattr(other, name), at))

    def _each(self, sensor: Sensor) -> tuple[Floats, Floats]:
        """zhat (r, T, m) and its covariance (r, T, m, m) of each mode."""
        each = [bank.predicted_measurement(sensor) for bank in self.banks]
        return np.stack([zhat for zhat, _ in each]), np.stack([cov for _, cov in each])

    def _enter(self, count: int, scale: Floats) -> None:
        self.mode = np.concatenate([self.mode, np.tile(self.prior, (count, 1))])
        self.hits = np.concatenate([self.hits, np.ones(count, np.int64)])
        self.scale = np.concatenate([self.scale, scale])
        self.x, self.P = self._moments(self.banks, self.mode)

    def _moved(self, dt: float) -> tuple[tuple[KalmanBank, ...], Floats]:
        """The banks after mixing and a prediction by dt seconds, and the probabilities of the modes then."""
        banks, mode = self._mixed(dt)
        moved = tuple(copy(bank) for bank in banks)
        for bank in moved:
            bank.predict(dt)
        return moved, mode

    def _mixed(self, dt: float) -> tuple[tuple[KalmanBank, ...], Floats]:
        """The banks as they are now for each mode dt seconds later, and the probabilities of the modes then.

        The last answer is kept: the smoother asks for it before the prediction.
        """
        known = self._known
        if known is not None and known.dt == dt and known.of_x is self.x:
            return known.banks, known.mode
        switch = self._switching(dt)
        mode = self.mode @ switch
        banks = []
        for j, bank in enumerate(self.banks):
            weight = (self.mode * switch[:, j] / np.maximum(mode[:, j : j + 1], LEAST)).T
            lifted = [_lifted(other, bank, 2 * self.model.dim) for other in self.banks]
            mixed = copy(bank)
            mixed.x, mixed.P = _mixture(weight, np.stack([x for x, _ in lifted]), np.stack([P for _, P in lifted]))
            banks.append(mixed)
        self._known = _Mixed(dt, self.x, tuple(banks), mode)
        return self._known.banks, mode

    def _switching(self, dt: float) -> Floats:
        """(r, r) transition probabilities of the models over dt seconds."""
        stay = np.exp(-dt * self.left)
        return (1 - stay) * self.rates / self.left + np.diag(stay[:, 0])

    def _moments(self, banks: Sequence[KalmanBank], mode: Floats) -> tuple[Floats, Floats]:
        """x (T, n), P (T, n, n) of position and velocity over all modes."""
        n = 2 * self.model.dim
        return _mixture(mode.T, np.stack([b.x[:, :n] for b in banks]), np.stack([b.P[:, :n, :n] for b in banks]))


def _lifted(source: KalmanBank, target: KalmanBank, shared: int) -> tuple[Floats, Floats]:
    """Moments of one mode in the state of another; components that the source lacks are the target's (Yuan 2012)."""
    if source.model.states == target.model.states:
        return source.x, source.P
    x, P = target.x.copy(), target.P.copy()
    x[:, :shared], P[:, :shared, :shared] = source.x[:, :shared], source.P[:, :shared, :shared]
    P[:, :shared, shared:] = 0.0
    P[:, shared:, :shared] = 0.0
    return x, P


def _mixture(weight: Floats, x: Floats, P: Floats) -> tuple[Floats, Floats]:
    """Mean (T, n) and covariance (T, n, n) of mixtures: weight (r, T), x (r, T, n), P (r, T, n, n)."""
    mean = np.einsum("rt,rti->ti", weight, x)
    off = x - mean
    cov = np.einsum("rt,rtij->tij", weight, P) + np.einsum("rt,rti,rtj->tij", weight, off, off)
    return mean, cov


def _log_normal(v: Floats, S: Floats) -> Floats:
    """(B,) ln N(v; 0, S) of v (B, m), S (B, m, m)."""
    d2 = np.einsum("ba,ba->b", v, np.linalg.solve(S, v[:, :, None])[:, :, 0])
    return -0.5 * (d2 + np.linalg.slogdet(S)[1] + v.shape[1] * np.log(2 * np.pi))
