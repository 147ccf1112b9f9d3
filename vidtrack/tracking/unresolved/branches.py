"""Other explanations of what a pair of tracks has given since its targets may be unresolved, kept for a while.

Whether a plot is of two targets or of one shows some scans later: of a pair that a false plot has parted wrongly, one
track is never seen again; a pair that stays together wrongly leaves plots that no track takes. Beside the states that
the tracker decided on, a pair has states by other explanations, each with its odds against the tracker's. Once one of
them is likelier the pair continues from it: multiple hypothesis tracking of two possibly unresolved targets.

W. Koch, G. van Keuk, "Multiple hypothesis track maintenance with possibly unresolved measurements", IEEE Trans.
Aerospace and Electronic Systems 33(3), 1997.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from itertools import product
from typing import NamedTuple

import numpy as np

from vidtrack.arrays.types import Floats, Ints
from vidtrack.associate.problem import Problem
from vidtrack.estimate.bank import Estimator, Mixture
from vidtrack.estimate.kernels import TURN
from vidtrack.estimate.sensor import POSITION, POSITION_VELOCITY, wrapped
from vidtrack.scan import Scan
from vidtrack.tracking.association import Association
from vidtrack.tracking.deferred.forest import one_each
from vidtrack.tracking.register import Register
from vidtrack.tracking.unresolved.cell import SIZES, TINY, PolarCell
from vidtrack.tracking.unresolved.claims import SURE, Placed, log_one
from vidtrack.tracking.unresolved.correlations import Correlations
from vidtrack.tracking.unresolved.joint import equivalent, exchange_probability

Key = tuple[bool, int, int]
"""What an explanation of a scan says: whether one plot is of both targets, and the plot of each."""

KEPT = 4
"""Branches of a pair beside the tracker's own states."""
WAYS = 3
"""Explanations of a scan with which a branch goes on, and measurements that each of its targets may have."""
SLACK = 12.0
"""ln of the odds against a branch at which it is given up."""
MARGIN = 1.0
"""ln of the odds for a branch from which the pair continues with it."""
TOGETHER = float(np.log((1 - SURE) / SURE))
"""ln of the odds against two targets with one measurement at which they still share it, as in `claims`."""
ALIKE = 3
"""Scans with the same measurements after which two branches are one, also if the names of the targets differ in all."""
PAIR = np.array([0, 1])


class Way(NamedTuple):
    """An explanation of a scan: which measurement each of two targets gave, -1: none, or both together.

    log_p  ln of its probability, up to a constant of the scan
    """

    shared: bool
    plots: tuple[int, int]
    log_p: float

    @property
    def key(self) -> Key:
        """What it says."""
        return self.shared, *self.plots

    @property
    def nameless(self) -> tuple[Key, ...]:
        """The same if only the names of the targets differ."""
        return _nameless((self.key,))


@dataclass(slots=True)
class Branch:
    """A possible state of two targets.

    bank, correlations  of two rows, the pair 0 and 1
    exchange            probability that the targets are exchanged
    score               (2,) of the tracks when it left the tracker's own states
    log_odds            of it against the tracker's own states
    past                keys of the explanations of the last scans, newest first
    plots               (2,) what the last scan gave of the targets, -1: nothing; shared: of both together
    """

    bank: Estimator
    correlations: Correlations
    exchange: float
    score: Floats
    log_odds: float = 0.0
    past: tuple[Key, ...] = ()
    plots: tuple[int, int] = (-1, -1)
    shared: bool = False

    @property
    def worth(self) -> float:
        """By which the states of a pair are compared."""
        return self.log_odds + self.shared * TOGETHER

    def predict(self, dt: float) -> None:
        """Move the state by dt seconds."""
        self.bank.predict(dt)
        self.correlations.predict(dt)

    def ways(self, problem: Problem, rows: Ints, theirs: Ints, cell: PolarCell) -> list[Way]:
        """Explanations of a scan by the measurements that may be theirs (C,), the likeliest first.

        P_D and clutter are those of the rows (2,) of the problem.
        """
        placed = Placed.of(problem, self.bank)
        ratio = _log_ratio(self.bank, problem, rows, theirs)
        missed = np.log1p(-np.minimum(problem.detection[rows], 1 - TINY))
        joint = self.correlations.joint(PAIR, placed.x, placed.P)
        R = placed.R[np.linalg.norm(placed.z - joint.middle, axis=1).argmin()]
        p = float(np.clip(cell.probability @ cell.shared(joint, 0, 1, R, SIZES), TINY, 1 - TINY))
        one = log_one(problem, int(rows[0]), placed, cell.confined(joint, R))[theirs]
        found = [Way(True, (-1, -1), np.log(p) + float(missed.sum()))]
        found += [Way(True, (int(theirs[k]),) * 2, np.log(p) + float(one[k])) for k in (-one).argsort()[:WAYS]]
        own = [[-1, *(-ratio[i]).argsort()[:WAYS].tolist()] for i in PAIR]
        for taken in product(*own):
            if taken[0] < 0 or taken[0] != taken[1]:
                log_l = sum(missed[i] if k < 0 else ratio[i, k] for i, k in enumerate(taken))
                a, b = (-1 if k < 0 else int(theirs[k]) for k in taken)
                found.append(Way(False, (a, b), float(np.log1p(-p) + log_l)))
        found.sort(key=lambda way: way.log_p)
        if self.correlations.has(PAIR):  # which is which is not in the data
            found = list({way.nameless: way for way in found}.values())
        return sorted(found, key=lambda way: -way.log_p)

    def after(self, way: Way, problem: Problem, cell: PolarCell, reference: float) -> Branch:
        """The branch to which an explanation of the scan leads; `reference`: ln p of the tracker's own."""
        placed, correlations, exchange = Placed.of(problem, self.bank), self.correlations.of((0, 1)), self.exchange
        bank, at = self.bank.only(PAIR), np.array(way.plots)
        joint = correlations.joint(PAIR, placed.x, placed.P)
        if way.shared and at[0] >= 0:
            s = placed.x.shape[1]
            joint = cell.confined(joint, placed.R[at[0]]).updated(placed.z[at[0]], placed.R[at[0]])
            z, R = np.empty((2, s)), np.empty((2, s, s))
            for i in PAIR:
                own = slice(i * s, (i + 1) * s)
                z[i], R[i] = equivalent(placed.x[i], placed.P[i], joint.x[own], joint.P[own, own])
            z += bank.x[:, :s] - placed.x
            bank.update(one_each(PAIR, PAIR), Scan(problem.scan.t, z, R, POSITION_VELOCITY), POSITION_VELOCITY)
            if isinstance(bank, Mixture):
                bank.forget(PAIR)
            correlations.keep(PAIR, joint, bank.P[:, :s, :s])
        elif not way.shared and at.max() >= 0:
            if correlations.has(PAIR):
                turned = exchange_probability(joint, np.where(at[:, None] < 0, np.nan, placed.z[at]), placed.R[at])
                exchange += turned - 2 * turned * exchange
                correlations = Correlations()
            bank.update(one_each(PAIR, at), problem.scan, problem.scan.sensor or POSITION)
        return Branch(
            bank, correlations, exchange, self.score, self.log_odds + way.log_p - reference,
            (way.key, *self.past)[:ALIKE], way.plots, way.shared,
        )  # fmt: skip


def _log_ratio(bank: Estimator, problem: Problem, rows: Ints, theirs: Ints) -> Floats:
    """(2, C) ln(P_D N / clutter density) of these measurements and the rows of a bank, as rows (2,) of the problem."""
    scan = problem.scan
    sensor = scan.sensor or POSITION
    if isinstance(bank, Mixture):
        weight, zhat, cov = bank.modes(sensor)
    else:
        zhat, cov = (each[None] for each in bank.predicted_measurement(sensor))
        weight = np.ones((1, 2))
    m = zhat.shape[2]
    v = scan.z[theirs] - zhat[:, :, None]
    v = wrapped(v.reshape(-1, m), sensor.angles).reshape(v.shape)
    S = cov[:, :, None] + scan.R[theirs]
    d2 = np.einsum("rtmi,rtmi->rtm", v, np.linalg.solve(S, v[..., None])[..., 0])
    with np.errstate(divide="ignore"):
        log_l = np.log(weight)[..., None] - 0.5 * (d2 + np.linalg.slogdet(S)[1] + m * np.log(TURN))
        seen = np.log(problem.detection[rows]) - np.log(np.maximum(problem.clutter[rows], TINY**2))
    return seen[:, None] + np.asarray(np.logaddexp.reduce(log_l, axis=0))


@dataclass(slots=True)
class Doubt:
    """What a pair of tracks may be beside what the tracker decided.

    branches  other states, the likeliest first
    past      keys of the tracker's own explanations of the last scans, newest first
    own       the tracker's own states before the scan that is being decided, with its explanations of the scan
    ways      explanations of the scan by each branch
    """

    branches: list[Branch] = field(default_factory=list)
    past: tuple[Key, ...] = ()
    own: tuple[Branch, list[Way]] | None = None
    ways: list[list[Way]] = field(default_factory=list)


@dataclass(slots=True)
class Doubts:
    """The doubts about pairs of tracks, by their ids, the smaller one first."""

    of_pair: dict[tuple[int, int], Doubt] = field(default_factory=dict)
    _problem: Problem | None = None

    def begin(
        self, problem: Problem, pairs: Ints, rows: Ints, register: Register, bank: Estimator,
        correlations: Correlations, cell: PolarCell, dt: float,
    ) -> None:  # fmt: skip
        """Explain a scan, dt seconds after the last; pairs (Q, 2) of the rows that are shown may be unresolved.

        Tracks that may be unresolved from several others have no branches.
        """
        self._problem = problem
        row_of = dict(zip(register.id[rows].tolist(), rows.tolist(), strict=True))
        doubts = {pair: doubt for pair, doubt in self.of_pair.items() if row_of.keys() >= set(pair)}
        for doubt in doubts.values():
            for branch in doubt.branches:
                branch.predict(dt)
        near = np.sort(register.id[pairs], axis=1)
        track, count = np.unique(near, return_counts=True)
        crowded = set(track[count > 1].tolist())
        for one, other in near.tolist():
            doubts.setdefault((one, other), Doubt())
        self.of_pair = doubts = {pair: doubt for pair, doubt in doubts.items() if crowded.isdisjoint(pair)}
        if not problem.measurements:
            return
        owner = _owners(problem, rows)
        for pair, doubt in doubts.items():
            own = np.array([row_of[track] for track in pair])
            theirs = np.flatnonzero((owner < 0) | np.isin(owner, own))
            branch = Branch(
                bank.only(own), correlations.of(pair), float(register.exchange[own[0]]), register.score[own], 0.0,
                doubt.past,
            )  # fmt: skip
            doubt.own = branch, branch.ways(problem, own, theirs, cell)
            doubt.ways = [other.ways(problem, own, theirs, cell) for other in doubt.branches]

    def decide(
        self, found: Association, register: Register, bank: Estimator, correlations: Correlations, cell: PolarCell
    ) -> None:
        """Compare the branches with what the tracker decided; where one is likelier, the pair continues with it."""
        for pair, doubt in list(self.of_pair.items()):
            rows = [np.flatnonzero(register.id == track) for track in pair]
            if self.of_pair.get(pair) is not doubt or doubt.own is None or not all(len(each) for each in rows):
                continue
            self._grow(doubt, found, rows, cell)
            best = max(range(len(doubt.branches)), key=lambda k: doubt.branches[k].worth, default=None)
            if best is not None and doubt.branches[best].worth > MARGIN + doubt.past[0][0] * TOGETHER:
                self._follow(pair, best, rows, found, register, bank, correlations)
            doubt.own = None
        self.of_pair = {pair: doubt for pair, doubt in self.of_pair.items() if doubt.branches}

    def _grow(self, doubt: Doubt, found: Association, rows: list[Ints], cell: PolarCell) -> None:
        """Replace the branches by those that the scan leaves likely enough."""
        assert doubt.own is not None
        assert self._problem is not None
        own, ways = doubt.own
        chosen = _chosen(ways, found, rows)
        doubt.past = (chosen.key, *doubt.past)[:ALIKE]
        offers = [(branch, way) for branch, each in zip(doubt.branches, doubt.ways, strict=True) for way in each[:WAYS]]
        certain = own.correlations.has(PAIR)
        others = [way for way in ways[:WAYS] if way.key != chosen.key]
        offers += [(own, way) for way in others if not (certain and way.nameless == chosen.nameless)]
        offers.sort(key=lambda offer: -(offer[0].log_odds + offer[1].log_p))
        seen = {_nameless(doubt.past)} if len(doubt.past) == ALIKE else set()
        branches: list[Branch] = []
        for branch, way in offers:
            past = _nameless((way.key, *branch.past)[:ALIKE])
            if branch.log_odds + way.log_p - chosen.log_p < -SLACK or len(branches) == KEPT:
                break
            if past not in seen:
                branches.append(branch.after(way, self._problem, cell, chosen.log_p))
                if len(past) == ALIKE:
                    seen.add(past)
        doubt.branches = branches

    def _follow(
        self, pair: tuple[int, int], number: int, rows: list[Ints], found: Association, register: Register,
        bank: Estimator, correlations: Correlations,
    ) -> None:  # fmt: skip
        """Continue a pair with a branch; the tracker's own states become a branch. Other doubts about
        these tracks end.

        Which measurements start tracks stays as it is: a forest has begun their trees in the association.
        """
        doubt, every = self.of_pair[pair], np.concatenate(rows)
        best = doubt.branches.pop(number)
        first = np.array([each[0] for each in rows])
        left = Branch(
            bank.only(first), correlations.of(pair), float(register.exchange[first[0]]), register.score[first], 0.0,
            doubt.past,
        )  # fmt: skip
        doubt.branches = [replace(other, log_odds=other.log_odds - best.log_odds) for other in [*doubt.branches, left]]
        doubt.past = best.past
        whose = np.repeat(PAIR, [len(each) for each in rows])
        bank.put(every, best.bank, whose)
        correlations.set(pair, best.correlations)
        register.exchange[every] = best.exchange
        register.score[every] = np.maximum(register.score[every], best.score[whose])
        seen = np.array(best.plots)[whose]
        found.choose(every, seen, best.shared)
        register.history[every[seen >= 0]] |= 1
        register.updated_s[every[seen >= 0]] = found.problem.scan.t
        self.of_pair = {
            other: each for other, each in self.of_pair.items() if other == pair or not set(other) & set(pair)
        }


def _nameless(past: tuple[Key, ...]) -> tuple[Key, ...]:
    """The same for explanations of some scans that differ by the names of the targets only, in all scans alike."""
    return min(past, tuple((shared, other, one) for shared, one, other in past))


def _owners(problem: Problem, rows: Ints) -> Ints:
    """(M,) of these rows, the one whose measurement each is likeliest; -1: it is in nobody's gate."""
    pairs = problem.pairs
    at = np.flatnonzero(np.isin(pairs.row, rows))
    order = at[np.argsort(problem.log_ratio[at], kind="stable")]
    owner = np.full(problem.measurements, -1)
    owner[pairs.measurement[order]] = pairs.row[order]
    return owner


def _chosen(ways: list[Way], found: Association, rows: list[Ints]) -> Way:
    """The tracker's explanation of a pair with these rows: of several the likeliest, also if it is none of the ways."""
    own = [set(found.measurement[each].tolist()) for each in rows]
    shared = bool((found.shared[np.concatenate(rows)] >= 0).any())
    fit = (
        way for way in ways if way.shared == shared and all(a in each for a, each in zip(way.plots, own, strict=True))
    )
    plots = int(found.measurement[rows[0][0]]), int(found.measurement[rows[1][0]])
    return next(fit, Way(shared, plots, ways[0].log_p))
