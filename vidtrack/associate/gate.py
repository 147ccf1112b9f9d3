"""The gate: pairs of tracks and measurements that are close enough to be associated."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Literal

import numpy as np
from scipy.special import gammainc, gammaincinv

from vidtrack.amplitude.reduction import ball
from vidtrack.arrays.rows import each, starts
from vidtrack.arrays.types import Floats, Ints, Mask
from vidtrack.associate.grid import cells
from vidtrack.compiled import inlined, specialised
from vidtrack.errors import ConfigError
from vidtrack.estimate.kernels import TURN
from vidtrack.scan import Scan

Distance = Literal["mahalanobis", "decoupled", "box", "euclidean"]
FULL, DECOUPLED, BOX, EUCLIDEAN = range(4)
PROBABILITY = 0.999
"""Default share of true measurements inside a gate."""
_MODES = {"mahalanobis": FULL, "decoupled": DECOUPLED, "box": BOX, "euclidean": EUCLIDEAN}


@dataclass(slots=True)
class Pairs:
    """Gated (track, measurement) pairs, sorted by track.

    row, measurement (N,)
    d2     (N,) squared distance that the gate compares: v' S^-1 v, eq. (8), largest v^2 / S of an axis, or |v|^2
    nis    (N,) v' S^-1 v for every kind of distance, and log_s (N,) ln|S|
    log_l  (N,) log-likelihood of the pair, ln N(v; 0, S) plus terms of attributes
    cost   (N,) cost for association: d2 plus log_s (without log_s for the euclidean distance), so that pairs of
           different tracks can be compared, plus terms of attributes
    limit  (T,) the gate: largest d2 admitted in each row
    start  (T + 1,) pairs of row t are start[t]..start[t+1]
    """

    row: Ints
    measurement: Ints
    d2: Floats
    nis: Floats
    log_s: Floats
    log_l: Floats
    cost: Floats
    limit: Floats
    start: Ints

    def __len__(self) -> int:
        return len(self.row)

    def only(self, mask: Mask) -> Pairs:
        """The pairs of a mask (N,)."""
        pair = mask.nonzero()[0]
        if len(pair) == len(mask):
            return self
        row = self.row.take(pair)
        return self._as(row, pair, self.limit, starts(row, len(self.limit)))

    def of(self, rows: Ints) -> Pairs:
        """The pairs of these rows (K,), which may repeat."""
        count = np.diff(self.start)[rows]
        start = np.concatenate([[0], np.cumsum(count)])
        pair = np.repeat(self.start[rows] - start[:-1], count) + np.arange(start[-1])
        return self._as(np.repeat(np.arange(len(rows)), count), pair, self.limit[rows], start)

    def _as(self, row: Ints, pair: Ints, limit: Floats, start: Ints) -> Pairs:
        """The pairs of these indices (N,), renumbered to the rows `row` (N,), whose gates are `limit` (K,)."""
        return Pairs(
            row, self.measurement.take(pair), self.d2.take(pair), self.nis.take(pair),
            self.log_s.take(pair), self.log_l.take(pair), self.cost.take(pair), limit, start,
        )  # fmt: skip


@dataclass(frozen=True, slots=True)
class Gate:
    """The confidence region of each predicted measurement (paper 004, section III).

    probability  share of true measurements inside; the limit on d2 is its chi-square quantile
    distance     mahalanobis: v' S^-1 v with the full S; decoupled: variances of the axes only, eq. (8) with the
                 innovation variance; box: each axis separately, `probability` of each (.9973 is 3 sigma); euclidean:
                 |v|^2, a baseline without confidence region
    radius       px or m, gate of the euclidean distance
    """

    probability: float = PROBABILITY
    distance: Distance = "mahalanobis"
    radius: float = 50.0

    def __post_init__(self) -> None:
        if not 0 <= self.probability <= 1:
            raise ConfigError(f"gate probability is {self.probability}; it must lie in 0..1")
        if self.distance not in _MODES:
            raise ConfigError(f"distance is {self.distance!r}; choose from {', '.join(_MODES)}")
        if not self.radius > 0:
            raise ConfigError(f"gate radius is {self.radius}; it must be above zero")

    def limit(self, dim: int) -> float:
        """Largest admitted squared distance in `dim` dimensions."""
        if self.distance == "euclidean":
            return self.radius**2
        return quantile(self.probability, 1 if self.distance == "box" else dim)

    def limits(self, cov: Floats, scan: Scan, detection: Floats, clutter: Floats, weight: Floats) -> Floats:
        """(T,) largest admitted squared distance of each row; P_D, clutter density and weight (T,) do not count."""
        return each(self.limit(cov.shape[1]), len(cov))

    def inside(self, limit: Floats, dim: int) -> Floats:
        """(T,) P_G, the share of a target's own measurements that gates of these limits admit: `probability`.

        The axes of a box are taken as independent.
        """
        return np.full(limit.shape, self.probability ** (dim if self.distance == "box" else 1))

    def pairs(
        self,
        zhat: Floats,
        cov: Floats,
        scan: Scan,
        run: Ints | None = None,
        angles: tuple[int, ...] = (),
        detection: float | Floats = 0.9,
        clutter: float | Floats = 1e-5,
        weight: float | Floats = 1.0,
    ) -> Pairs:
        """All pairs inside the gate, both sides of the same Monte Carlo run.

        zhat (T, m) predicted measurements and cov (T, m, m) their covariance H P H'; S adds each measurement's R.
        `angles` are components in -pi..pi that wrap. `detection` and `clutter` are P_D and the density of false
        measurements, `weight` the probability of these predictions, one for all or (T,). Candidates come from a grid
        over the first two axes, so the time grows with the number of pairs and not with T times M.
        """
        rows = len(zhat)
        limit = self.limits(cov, scan, each(detection, rows), each(clutter, rows), each(weight, rows))
        mode = _MODES[self.distance]
        runs = np.zeros(len(scan), np.int64) if scan.run is None else scan.run
        own = np.zeros(len(zhat), np.int64) if run is None else run
        gated = _gated(zhat.shape[1], angles)
        row, measurement, d2, nis, log_s, log_l, start = gated(mode, zhat, cov, own, limit, scan.z, scan.R, runs)
        cost = d2 if mode == EUCLIDEAN else d2 + log_s
        return Pairs(row, measurement, d2, nis, log_s, log_l, cost, limit, start)


@dataclass(frozen=True, slots=True)
class LikelihoodGate(Gate):
    """The maximum-likelihood gate, which is optimal for two hypotheses (SPEC 001; Blackman 1986, section 4.2).

    A pair is admitted if it is likelier than its alternative, that the target is missed and the measurement is false or
    of a new target: v' S^-1 v <= 2 ln(P_D / ((1 - P_D) density (2 pi)^(M/2) |S|^(1/2))), with S from the scan's mean R.
    Among few false measurements the gate is wide, and holds a target that manoeuvres; in dense ones it is narrow.
    With a `loss` above one it is wider, by 2 ln(loss), as long as it holds one false measurement at most on average.

    detection_probability, new_density [per unit of measurement space]   P_D, and the density of false measurements and
    new targets. None: the P_D and clutter density of the tracker, the latter with new_share of new targets in addition
    loss  what it costs to refuse a target's measurement, in costs of admitting a false one. The least expected cost
          admits what is less than so many times less likely than its alternative
    """

    detection_probability: float | None = 0.9
    new_density: float | None = 1e-5
    new_share: float = 0.1
    loss: float = 1.0

    def __post_init__(self) -> None:
        Gate.__post_init__(self)
        if self.detection_probability is not None and not 0 < self.detection_probability <= 1:
            raise ConfigError(f"detection probability is {self.detection_probability}; it must be above 0, at most 1")
        if self.new_density is not None and not self.new_density > 0:
            raise ConfigError(f"density of new targets is {self.new_density}; it must be above zero")
        if not 1 <= self.loss < np.inf:
            raise ConfigError(f"loss is {self.loss}; it must be 1 or more, and finite")
        if self.distance != "mahalanobis":
            raise ConfigError(f"distance is {self.distance!r}; the maximum-likelihood gate needs mahalanobis")

    def limits(self, cov: Floats, scan: Scan, detection: Floats, clutter: Floats, weight: Floats) -> Floats:
        """(T,) largest admitted squared distance of each row; zero where no measurement is likely enough."""
        dim = cov.shape[1]
        S = cov if scan.noise is None else cov + scan.noise
        seen = detection if self.detection_probability is None else self.detection_probability
        density = clutter * (1 + self.new_share) if self.new_density is None else self.new_density
        log_s = np.linalg.slogdet(S)[1]
        with np.errstate(divide="ignore", over="ignore"):  # P_D of one, or no clutter: all is likelier than a miss
            odds = np.log(weight * seen) - np.log(1 - seen) - np.log(density)
            one_false = np.exp(-(np.log(density * ball(dim)) + log_s / 2) * 2 / dim)
        likelier = 2 * odds - dim * np.log(TURN) - log_s
        return np.maximum(0.0, np.maximum(likelier, np.minimum(likelier + 2 * np.log(self.loss), one_false)))

    def inside(self, limit: Floats, dim: int) -> Floats:
        """(T,) P_G, the share of a target's own measurements that gates of these limits admit; chi-square."""
        return gammainc(dim / 2, limit / 2)


@lru_cache
def quantile(probability: float, dim: int) -> float:
    """Chi-square quantile."""
    return float(2 * gammaincinv(dim / 2, probability))


@inlined
def _reach(cov: Floats, R: Floats, limit: Floats, mode: int) -> Floats:
    """(T, 2) half sides of the bounding box of each gate, on the first two axes."""
    axes = min(2, cov.shape[1])
    widest = np.zeros(2)
    for j in range(len(R)):
        for a in range(axes):
            widest[a] = max(widest[a], R[j, a, a])
    reach = np.empty((len(cov), 2))
    for t in range(len(cov)):
        for side in range(2):
            a = min(side, axes - 1)
            reach[t, side] = np.sqrt(limit[t] if mode == EUCLIDEAN else limit[t] * (cov[t, a, a] + widest[a]))
    return reach


@lru_cache
def _gated(m: int, angles: tuple[int, ...]) -> Callable[..., tuple[Ints, Ints, Floats, Floats, Floats, Floats, Ints]]:
    """The kernel that finds the pairs inside the gate; m and angles are compile-time constants.

    It returns row, measurement, d2, nis, log_s, log_l and start of the pairs. The measurements of a row ascend.
    """
    wraps = tuple(a in angles for a in range(m))
    turns = 1 if any(a in angles for a in range(2)) else 0

    def gated(
        mode: int, zhat: Floats, cov: Floats, own: Ints, limit: Floats, z: Floats, R: Floats, run: Ints
    ) -> tuple[Ints, Ints, Floats, Floats, Floats, Floats, Ints]:
        rows = len(zhat)
        reach = _reach(cov, R, limit, mode)
        order, first, origin, cell, shape = cells(z, run, reach)
        runs = (len(first) - 1) // (shape[0] * shape[1])
        L, v = np.empty((m, m)), np.empty(m)
        low, high = np.empty(2, np.int64), np.empty(2, np.int64)
        size, n = 0, 4 * rows + 16
        while n > size:  # there were more pairs than room: once more, with room for all
            size, n = n, 0
            pair, value = np.empty((size, 2), np.int64), np.empty((size, 3))
            seen = np.full(len(z) if turns else 0, -1)
            for t in range(rows):
                if limit[t] == 0.0 or own[t] >= runs:
                    continue
                for turn in range(-turns, turns + 1):
                    outside = False
                    for a in range(2):
                        at = zhat[t, a] + turn * TURN * wraps[a] if a < m else 0.0
                        below = np.floor((at - reach[t, a] - origin[a]) / cell[a])
                        above = np.floor((at + reach[t, a] - origin[a]) / cell[a])
                        outside |= not (below < shape[a] and above >= 0)
                        low[a] = max(0.0, min(below, shape[a] - 1.0))
                        high[a] = max(0.0, min(above, shape[a] - 1.0))
                    if outside:
                        continue
                    for line in range(low[1], high[1] + 1):
                        base = (own[t] * shape[1] + line) * shape[0]
                        for at_point in range(first[base + low[0]], first[base + high[0] + 1]):
                            j = order[at_point]
                            if turns:  # a gate wider than a full turn finds a measurement from both sides
                                if seen[j] == t:
                                    continue
                                seen[j] = t
                            distance, whitened, det = 0.0, 0.0, 1.0
                            for a in range(m):  # S = L L' and L^-1 v, row by row
                                v[a] = z[j, a] - zhat[t, a]
                                if wraps[a]:
                                    v[a] -= TURN * np.rint(v[a] / TURN)
                                variance = cov[t, a, a] + R[j, a, a]
                                if mode == EUCLIDEAN:
                                    distance += v[a] * v[a]
                                elif mode == DECOUPLED:
                                    distance += v[a] * v[a] / variance
                                elif mode == BOX:
                                    distance = max(distance, v[a] * v[a] / variance)
                                for b in range(a):
                                    entry = cov[t, a, b] + R[j, a, b]
                                    for c in range(b):
                                        entry -= L[a, c] * L[b, c]
                                    L[a, b] = entry / L[b, b]
                                    variance -= L[a, b] * L[a, b]
                                    v[a] -= L[a, b] * v[b]
                                L[a, a] = np.sqrt(variance)
                                v[a] /= L[a, a]
                                whitened += v[a] * v[a]
                                det *= L[a, a]
                            if mode == FULL:
                                distance = whitened
                            if not distance <= limit[t]:
                                continue
                            if n < size:
                                pair[n, 0], pair[n, 1] = t, j
                                value[n, 0], value[n, 1], value[n, 2] = distance, whitened, 2.0 * np.log(det)
                            n += 1
        # the order in the grid depends on the cell size; results must not
        order, start = _ascending(pair, n, rows, len(z))
        row, measurement = np.empty(n, np.int64), np.empty(n, np.int64)
        d2, nis, log_s, log_l = np.empty(n), np.empty(n), np.empty(n), np.empty(n)
        for p in range(n):
            row[p], measurement[p] = pair[order[p], 0], pair[order[p], 1]
            d2[p], nis[p], log_s[p] = value[order[p], 0], value[order[p], 1], value[order[p], 2]
            log_l[p] = -0.5 * (nis[p] + log_s[p] + m * np.log(TURN))
        return row, measurement, d2, nis, log_s, log_l, start

    return specialised(gated, m, *angles)


@inlined
def _ascending(pair: Ints, count: int, rows: int, measurements: int) -> tuple[Ints, Ints]:
    """(count,) order by row, then measurement, of the pairs (row, measurement); (rows + 1,) where each row starts.

    Two counting sorts.
    """
    first, start = np.zeros(measurements + 1, np.int64), np.zeros(rows + 1, np.int64)
    for p in range(count):
        start[pair[p, 0] + 1] += 1
        first[pair[p, 1] + 1] += 1
    for j in range(measurements):
        first[j + 1] += first[j]
    for t in range(rows):
        start[t + 1] += start[t]
    by_measurement, order, place = np.empty(count, np.int64), np.empty(count, np.int64), start.copy()
    for p in range(count):
        by_measurement[first[pair[p, 1]]] = p
        first[pair[p, 1]] += 1
    for index in by_measurement:
        order[place[pair[index, 0]]] = index
        place[pair[index, 0]] += 1
    return order, start
