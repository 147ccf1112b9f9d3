"""The particle filter of paper 003, which keeps only particles near the measurement."""

from __future__ import annotations

import numpy as np

from vidtrack.arrays.types import Floats, Ints, Mask
from vidtrack.compiled import kernel
from vidtrack.decision import Decision
from vidtrack.errors import ConfigError
from vidtrack.estimate.kernels import TURN
from vidtrack.estimate.motion.model import Motion
from vidtrack.estimate.particle import NO_GLINT, Glint, ParticleBank
from vidtrack.estimate.particle_kernels import copy, normalise
from vidtrack.estimate.sensor import Sensor
from vidtrack.scan import Scan


class ErrorSignalBank(ParticleBank):
    """Particle filters with the resampling of paper 003, fig. 3, after each measurement.

    Particles nearer than alpha to a measurement stay, with their weights, and are copied in turn until there are N. If
    none is near, all are drawn again, uniformly within alpha of the measurement and with equal weights; they keep their
    velocities. A row without measurements keeps all its particles.

    Copies keep their weights, so this does not cure degeneracy, and it uses the measurement twice.
    `vidtrack reproduce 003-table2` measures the cost.

    alpha  in standard deviations of each component of the measurement; the paper's 25 m and 0.2 degrees are five
    """

    def __init__(
        self, model: Motion, number: int = 2000, *, alpha: float = 5.0, glint: Glint = NO_GLINT, seed: int = 0
    ) -> None:
        if not alpha > 0:
            raise ConfigError(f"error-signal resampling: alpha is {alpha}; it must be above zero")
        super().__init__(model, number, least=0, glint=glint, seed=seed)
        self.alpha = alpha

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
        limit = self.alpha * np.sqrt(np.diagonal(scan.R, axis1=1, axis2=2))
        wraps = np.isin(np.arange(seen.shape[2]), sensor.angles)
        chosen = np.empty((len(weight), *self.particles.shape[1:]))
        survivors = keep_near(
            scan.z, limit, wraps, seen, self.particles, decision.parent, start, decision.measurement,
            log_weight, chosen,
        )  # fmt: skip
        lone = np.flatnonzero(survivors == 0)
        if len(lone):
            pairs = start[lone] + (self.rng.random((self.number, len(lone))) * np.diff(start)[lone]).astype(np.int64)
            j = decision.measurement[pairs.T.ravel()]
            z = scan.z[j] + limit[j] * self.rng.uniform(-1, 1, (len(j), scan.z.shape[1]))
            position = sensor.locate(z, scan.R[j])[0].reshape(len(lone), self.number, -1)
            chosen[lone[:, None], :, self.model.position] = np.moveaxis(position, 2, 1)
            log_weight[lone] = -np.log(self.number)
        return chosen


@kernel
def keep_near(
    z: Floats, limit: Floats, wraps: Mask, seen: Floats, x: Floats, parent: Ints, start: Ints,
    measurement: Ints, log_weight: Floats, new: Floats,
) -> Ints:  # fmt: skip
    """Number of particles kept in each row (K,); fills new (K, N, n) and log_weight (K, N), normalised.

    z (M, m), limit (M, m), wraps (m,) which components are angles, seen (T, N, m), x (T, N, n), parent (K,), start
    (K + 1,), measurement (B,). Rows without near particles and rows without measurements keep all.
    """
    number = log_weight.shape[1]
    near, chosen, weight = np.empty(number, np.bool_), np.empty(number, np.int64), np.empty(number)
    survivors = np.empty(len(parent), np.int64)
    for k in range(len(parent)):
        t = parent[k]
        for i in range(number):
            near[i] = start[k] == start[k + 1]
            for b in range(start[k], start[k + 1]):
                near[i] |= _within(z[measurement[b]], seen[t, i], limit[measurement[b]], wraps)
        survivors[k] = cycle(near, chosen)
        if survivors[k] == 0:
            new[k] = x[t]
            continue
        copy(x[t], chosen, new[k])
        for i in range(number):
            weight[i] = log_weight[k, chosen[i]]
        log_weight[k] = weight
        normalise(log_weight[k], weight)
    return survivors


@kernel
def cycle(near: Mask, chosen: Ints) -> int:
    """Fill chosen (N,) with the indices of the near (N,) particles in turn; returns how many are near.

    With none, chosen is unchanged. The loop printed in fig. 3 begins one too early and would lose the last particle.
    """
    survivors = 0
    for i in range(len(near)):
        if near[i]:
            chosen[survivors] = i
            survivors += 1
    if survivors > 0:
        for i in range(survivors, len(chosen)):
            chosen[i] = chosen[i - survivors]
    return survivors


@kernel
def _within(z: Floats, seen: Floats, limit: Floats, wraps: Mask) -> bool:
    for a in range(len(z)):
        error = z[a] - seen[a]
        if wraps[a]:
            error -= TURN * np.rint(error / TURN)
        if not abs(error) < limit[a]:
            return False
    return True
