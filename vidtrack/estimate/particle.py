"""The particle bank: states as weighted samples, for distributions that are not normal."""

from __future__ import annotations

from copy import copy
from typing import NamedTuple, Self

import numpy as np

from vidtrack.arrays.rows import replaced, starts
from vidtrack.arrays.types import Floats, Ints
from vidtrack.decision import Decision
from vidtrack.errors import ConfigError
from vidtrack.estimate.blocks import in_blocks
from vidtrack.estimate.motion.model import Motion
from vidtrack.estimate.particle_kernels import moments, move, resample, weigh
from vidtrack.estimate.progressive import STEPS, Parts, effective, powers, weighed
from vidtrack.estimate.resampling import Resampling
from vidtrack.estimate.sensor import Sensor, wrapped
from vidtrack.estimate.smoother import linearised_cross
from vidtrack.scan import Scan

BLOCK = 50_000
"""Particles in a block; smaller blocks do not repay a thread."""


class Glint(NamedTuple):
    """With this probability the error of a measurement's component is `factor` times as large."""

    probability: float
    factor: float = 5.0


NO_GLINT = Glint(0.0)


class ParticleBank:
    """Particle filters, one per row, with the motion model as proposal (Gordon, Salmond and Smith 1993).

    number      N, particles per row
    resampling  scheme of resampling
    threshold   a row is resampled when the effective number 1 / sum of w^2 falls below this share of N
    least       a row that one scan would leave with a smaller share is corrected progressively (`progressive`): its
                plot lies in the tail of the particles, as in a turn; 0: never, as in the bootstrap filter
    glint       distribution of the measurement errors, if not normal
    seed        of all random numbers, which do not depend on the number of threads

    particles (T, N, n), log_weight (T, N), the weights of a row sum to one; hits (T,) updates so far; scale (T,) size
    of each object if the model is `per_size`, else one. A decision's inflation is not used: the particles outside the
    gate represent it already.
    """

    def __init__(
        self,
        model: Motion,
        number: int = 2000,
        *,
        resampling: Resampling = Resampling.SYSTEMATIC,
        threshold: float = 0.5,
        least: float = 0.1,
        glint: Glint = NO_GLINT,
        seed: int = 0,
    ) -> None:
        if number < 2:
            raise ConfigError(f"particle filter: {number} particles; it needs two at least")
        if not 0 <= least < 1:
            raise ConfigError(f"particle filter: least is {least}; it is a share, at least zero and below one")
        if not 0 <= glint.probability < 1 or not glint.factor >= 1:
            raise ConfigError(f"particle filter: {glint}; the probability is below one and the factor at least one")
        self.model = model
        self.number = number
        self.resampling = resampling
        self.threshold = threshold
        self.least = least
        self.glint = glint
        self.rng = np.random.default_rng(seed)
        self.particles = np.empty((0, number, model.states))
        self.log_weight = np.empty((0, number))
        self.hits = np.empty(0, np.int64)
        self.scale = np.empty(0)
        self._moments: tuple[Floats, Floats] | None = None

    def __len__(self) -> int:
        return len(self.particles)

    @property
    def x(self) -> Floats:
        """(T, n) means."""
        return self._known()[0]

    @property
    def P(self) -> Floats:  # noqa: N802
        """(T, n, n) covariances."""
        return self._known()[1]

    def cross(self, dt: float) -> Floats:
        """(T, n, n) P J', with the derivative J of the motion at the means, without the particles' spread."""
        return linearised_cross(self.model, dt, self.x, self.P)

    def ahead(self, dt: float) -> tuple[Floats, Floats]:
        moved = self.particles.copy()
        self._move(moved, self._transition(dt), np.zeros_like(self.P))
        x, P = self._mean_and_cov(moved, self.log_weight)
        return x, P + self._process_noise(dt)

    def predict(self, dt: float) -> None:
        """Predict all particles by dt seconds, each with its own sample of the process noise."""
        self._move(self.particles, self._transition(dt), self._process_noise(dt))
        self._moments = None

    def predicted_measurement(self, sensor: Sensor) -> tuple[Floats, Floats]:
        """Mean zhat (T, m) and covariance (T, m, m) of h(particles), without R."""
        seen, weight = self._seen(sensor), np.exp(self.log_weight)
        centre = np.zeros((len(self), seen.shape[2]))
        for a in sensor.angles:
            sine, cosine = ((weight * part(seen[..., a])).sum(axis=1) for part in (np.sin, np.cos))
            centre[:, a] = np.arctan2(sine, cosine)
        off = wrapped((seen - centre[:, None]).reshape(-1, seen.shape[2]), sensor.angles)
        mean, cov = self._mean_and_cov(off.reshape(seen.shape), self.log_weight)
        return wrapped(centre + mean, sensor.angles), cov

    def update(self, decision: Decision, scan: Scan, sensor: Sensor) -> None:
        """Successor rows from the weights of a decision; x, P are the moments before resampling.

        Rows with few effective particles are corrected progressively.
        """
        parent, rows = decision.parent, len(decision.parent)
        seen = self._seen(sensor)
        start = starts(decision.row, rows)
        weight, log_weight = np.empty((rows, self.number)), np.empty((rows, self.number))
        x, P = _empty(rows, self.model.states)

        def work(block: slice) -> None:
            weigh(seen.shape[2], sensor.angles)(
                self.log_weight, seen, scan.z, scan.R,
                parent[block], start[block.start : block.stop + 1], decision.measurement, decision.beta,
                decision.beta0[block], decision.spread, *self.glint, weight[block], log_weight[block],
            )  # fmt: skip
            moments(self.model.states)(weight[block], self.particles, parent[block], x[block], P[block])

        in_blocks(rows, self._block, work)
        particles = self._chosen(decision, start, scan, sensor, seen, weight, log_weight)
        if self.least > 0 and self.resampling != Resampling.NONE:
            few = np.flatnonzero(effective(weight) < self.least * self.number)
            if len(few):
                particles[few] = self._progressed(decision, few, scan, sensor)
                log_weight[few] = -np.log(self.number)
                x[few], P[few] = self._mean_and_cov(particles[few], log_weight[few])
        self.particles = particles
        self.log_weight = log_weight
        self._moments = x, P
        self.hits = self.hits[parent] + decision.hit
        self.scale = self.scale[parent]

    def _progressed(self, decision: Decision, rows: Ints, scan: Scan, sensor: Sensor) -> Floats:
        """Particles (K, N, n), of equal weights, of the successors `rows` (K,), corrected progressively."""
        parts = Parts.of(decision, rows)
        sets = self.only(decision.parent[parts.row])
        left, going = np.ones(len(sets)), np.arange(len(sets))
        for step in range(STEPS):
            gain = sets._gain(parts, scan, sensor)[going]
            power = powers(sets.log_weight[going], gain, left[going], self.least) if step < STEPS - 1 else left[going]
            sets.log_weight[going] = weighed(sets.log_weight[going], gain, power)
            left[going] -= power
            sets._resample(going[left[going] == 0])
            going = going[left[going] > 0]
            if not len(going):
                break
            sets._redraw(going)
        return parts.mixture(sets.particles)

    def _gain(self, parts: Parts, scan: Scan, sensor: Sensor) -> Floats:
        """(C, N) logarithms, up to a constant a row, of the likelihoods of the parts' measurements."""
        seen, everyone = self._seen(sensor), np.arange(len(self))
        weight, gain = np.empty((2, *self.log_weight.shape))
        weigh(seen.shape[2], sensor.angles)(
            np.zeros_like(gain), seen, scan.z, scan.R, everyone, parts.start, parts.measurement, parts.beta,
            np.zeros(len(self)), False, *self.glint, weight, gain,
        )  # fmt: skip
        return gain

    def _resample(self, rows: Ints) -> None:
        """Choose the particles of rows (R,) anew by their weights."""
        weight, chosen = np.exp(self.log_weight[rows]), np.empty((len(rows), *self.particles.shape[1:]))
        everyone = np.full(weight.shape, -np.log(self.number))
        resample(
            int(self.resampling), np.inf, weight, self.particles, rows, self._streams(len(rows)), everyone, chosen
        )  # fmt: skip
        self.particles[rows], self.log_weight[rows] = chosen, everyone

    def _redraw(self, rows: Ints) -> None:
        """Draw rows (R,) anew from normal distributions of the same means and covariances."""
        self.particles[rows] = self._normal(*self._mean_and_cov(self.particles[rows], self.log_weight[rows]))
        self.log_weight[rows] = -np.log(self.number)

    def _normal(self, x: Floats, P: Floats) -> Floats:
        """Particles (K, N, n) drawn from normal distributions with means x (K, n) and covariances P (K, n, n)."""
        drawn = np.repeat(np.asarray(x, float)[:, None], self.number, axis=1)
        self._move(drawn, np.eye(self.model.states)[None], P)
        return drawn

    def append(self, position: Floats, cov: Floats, scale: Floats) -> None:
        self.insert(*self.model.birth(position, cov, scale), scale)

    def insert(self, x: Floats, P: Floats, scale: Floats) -> None:
        """New rows, drawn from normal distributions with means x (B, n) and covariances P (B, n, n); scale (B,)."""
        new, before = self._normal(x, P), (self.x, self.P)
        self.particles = np.concatenate([self.particles, new])
        self.log_weight = np.concatenate([self.log_weight, np.full(new.shape[:2], -np.log(self.number))])
        self._moments = np.concatenate([before[0], x]), np.concatenate([before[1], P])
        self.hits = np.concatenate([self.hits, np.ones(len(x), np.int64)])
        self.scale = np.concatenate([self.scale, scale])

    def keep(self, rows: np.ndarray) -> None:
        if self._moments is not None:
            x, P = self._moments
            self._moments = x[rows], P[rows]
        self.particles, self.log_weight = self.particles[rows], self.log_weight[rows]
        self.hits, self.scale = self.hits[rows], self.scale[rows]

    def only(self, rows: Ints) -> Self:
        """A bank of its own of these rows (K,), with random numbers of its own."""
        bank = copy(self)
        bank.rng = self.rng.spawn(1)[0]
        bank.keep(rows)
        return bank

    def put(self, rows: Ints, other: Self, at: Ints) -> None:
        """Set these rows (K,) to rows `at` (K,) of another bank."""
        for name in ("particles", "log_weight", "hits", "scale"):
            setattr(self, name, replaced(getattr(self, name), rows, getattr(other, name), at))
        self._moments = None

    def _chosen(
        self,
        decision: Decision,
        start: Ints,
        scan: Scan,
        sensor: Sensor,
        seen: Floats,
        weight: Floats,
        log_weight: Floats,
    ) -> Floats:
        """Particles (K, N, n) of the successors, resampled where necessary; log_weight (K, N) changes in place."""
        if self.resampling == Resampling.NONE:
            return self.particles[decision.parent]
        chosen = np.empty((len(weight), *self.particles.shape[1:]))
        stream = self._streams(len(weight))

        def work(block: slice) -> None:
            resample(
                int(self.resampling), self.threshold, weight[block], self.particles, decision.parent[block],
                stream[block], log_weight[block], chosen[block],
            )  # fmt: skip

        in_blocks(len(weight), self._block, work)
        return chosen

    @property
    def _block(self) -> int:
        return max(1, BLOCK // self.number)

    def _streams(self, rows: int) -> np.ndarray:
        return self.rng.integers(2**64, size=rows, dtype=np.uint64)

    def _transition(self, dt: float) -> Floats:
        """F (1, n, n) or (T N, n, n) of the particles."""
        return self.model.transition(dt, self.particles.reshape(-1, self.model.states))

    def _process_noise(self, dt: float) -> Floats:
        return self.model.process_noise(dt, self.x, self.P, self.hits, self.scale)

    def _move(self, particles: Floats, F: Floats, Q: Floats) -> None:
        """Move particles (T, N, n) by F (1, n, n) or (T N, n, n) and noise of covariance Q (T, n, n), in place."""
        rows, n = len(particles), self.model.states
        each = np.broadcast_to(F.reshape(-1, 1 if len(F) == 1 else self.number, n, n), (rows, self.number, n, n))
        stream = self._streams(rows)
        in_blocks(rows, self._block, lambda block: move(n)(particles[block], each[block], Q[block], stream[block]))

    def _seen(self, sensor: Sensor) -> Floats:
        """(T, N, m) expected measurement h(x) of each particle."""
        seen = sensor.h(self.particles.reshape(-1, self.model.states), self.model.position)
        return seen.reshape(len(self), self.number, seen.shape[1])

    def _known(self) -> tuple[Floats, Floats]:
        """x, P, computed on first use."""
        if self._moments is None:
            self._moments = self._mean_and_cov(self.particles, self.log_weight)
        return self._moments

    def _mean_and_cov(self, particles: Floats, log_weight: Floats) -> tuple[Floats, Floats]:
        """Weighted mean (T, c) and covariance (T, c, c) of `particles` (T, N, c) with log_weight (T, N)."""
        rows, c = len(particles), particles.shape[2]
        mean, cov = _empty(rows, c)
        everyone = np.arange(rows)

        def work(block: slice) -> None:
            moments(c)(np.exp(log_weight[block]), particles, everyone[block], mean[block], cov[block])

        in_blocks(rows, self._block, work)
        return mean, cov


def _empty(rows: int, n: int) -> tuple[Floats, Floats]:
    return np.empty((rows, n)), np.empty((rows, n, n))
