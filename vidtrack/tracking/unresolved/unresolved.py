"""The model for point targets that a sensor does not resolve: tracks that share a measurement continue as they are.

Of two tracks whose predictions are near to each other, either both targets are resolved, and each gives a measurement
or none, or both together give one. The likelier explanation is taken before the association. Tracks that share a
measurement are updated by it jointly: it measures the middle of the targets. Their distance is then within the
resolution cell, and otherwise predicted by their motion. The correlation of their errors is kept until they are
resolved again, and says how probable it is that they have been exchanged by then.

W. Koch, G. van Keuk, "Multiple hypothesis track maintenance with possibly unresolved measurements", IEEE Trans.
Aerospace and Electronic Systems 33(3), 1997; H. A. P. Blom, E. A. Bloem, "Bayesian tracking of two possibly unresolved
maneuvering targets", IEEE Trans. Aerospace and Electronic Systems 43(2), 2007.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from vidtrack.arrays.types import Floats, Ints, Mask
from vidtrack.associate.problem import Problem
from vidtrack.decision import Decision, Event
from vidtrack.estimate.bank import Estimator, Mixture
from vidtrack.estimate.sensor import POSITION_VELOCITY
from vidtrack.scan import Scan
from vidtrack.tracking.association import Association
from vidtrack.tracking.picture.picture import View
from vidtrack.tracking.picture.road import Road
from vidtrack.tracking.register import Register
from vidtrack.tracking.unresolved.branches import Doubts
from vidtrack.tracking.unresolved.cell import PolarCell
from vidtrack.tracking.unresolved.claims import Placed, claims
from vidtrack.tracking.unresolved.correlations import Correlations
from vidtrack.tracking.unresolved.joint import Joint, equivalent, exchange_probability
from vidtrack.tracking.unresolved.packed import Packed
from vidtrack.tracks import TENTATIVE


@dataclass(slots=True)
class Unresolved:
    """How tracks of unresolved targets share measurements. It numbers the groups: each tracker needs its own.

    cell          resolution cell of the sensor whose scan is taken
    cells         those of all stations, if there are several
    correlations  of the errors of tracks that are not resolved
    """

    cell: PolarCell
    cells: Sequence[PolarCell] = ()
    correlations: Correlations = field(default_factory=Correlations, init=False)
    _made: int = field(default=0, init=False)
    _doubts: Doubts = field(default_factory=Doubts, init=False)
    _restored: Packed | None = field(default=None, init=False)
    _placed: Placed | None = field(default=None, init=False)
    _predicted: dict[int, int] = field(default_factory=dict, init=False)

    STATE = ("cell", "correlations", "_made", "branches")

    @property
    def branches(self) -> Packed:
        """Other explanations of pairs, as a saved state has them."""
        return self._restored or Packed.of(self._doubts.of_pair)

    @branches.setter
    def branches(self, packed: Packed) -> None:
        self._restored = packed

    def unresolved(self, problem: Problem, shown: Mask, register: Register, bank: Estimator, dt: float) -> Ints:
        """(T,) the measurement that each row shares, as the rows that are shown (T,) have it; -1: none."""
        self.cell = self.cells[problem.scan.station] if self.cells else self.cell
        self.correlations.predict(dt)
        if self._restored is not None:
            self._doubts.of_pair, self._restored = self._restored.doubts(bank), None
        rows = np.flatnonzero(shown & (register.status != TENTATIVE))
        self._placed = Placed.of(problem, bank)
        self._predicted = {track: row for row, track in enumerate(register.id.tolist())}
        self._predicted.update(zip(register.id[rows].tolist(), rows.tolist(), strict=True))
        shared, near = claims(problem, rows, register.id, register.run, self._placed, self.correlations, self.cell)
        self._doubts.begin(problem, near, rows, register, bank, self.correlations, self.cell, dt)
        for row in np.flatnonzero(shared >= 0):  # all possible histories of a track
            shared[register.id == register.id[row]] = shared[row]
        return shared

    def claim(self, view: View | None, taken: Ints, confirmed: Mask, count: int) -> tuple[Ints, Mask]:
        """Nothing is shared beyond what `unresolved` found."""
        return np.full(len(confirmed), -1), np.ones(count, bool)

    def catch(self, view: View | None, taken: Ints, shared: Ints, free: Mask) -> tuple[Ints, Mask]:
        """No track continues on what its gate does not hold."""
        return shared, free

    def update(self, found: Association, view: View | None, register: Register, bank: Estimator, dt: float) -> None:
        """Update the tracks that share a measurement jointly, part those that are resolved again, and set right what
        this scan shows of earlier decisions.
        """
        self._part(found, register)
        self._share(found, register, bank)
        self._doubts.decide(found, register, bank, self.correlations, self.cell)

    def _share(self, found: Association, register: Register, bank: Estimator) -> None:
        """Update the tracks that share a measurement jointly."""
        rows = np.flatnonzero(found.shared >= 0)
        if not len(rows):
            return
        placed, parent, s = self._placed, found.decision.parent, 2 * bank.model.dim
        assert placed is not None, "the measurements are claimed first"
        z, R = np.empty((len(rows), s)), np.empty((len(rows), s, s))
        after: list[tuple[Ints, Joint]] = []
        for k, row in enumerate(rows):
            j = found.shared[row]
            on_it = np.flatnonzero((found.shared == j) & (register.id != register.id[row]))
            others = on_it[np.unique(register.id[on_it], return_index=True)[1]]
            members = np.concatenate([[row], others])
            x, P = placed.x[parent[members]], placed.P[parent[members]]
            joint = self.correlations.joint(register.id[members], x, P)
            joint = self.cell.confined(joint, placed.R[j]).updated(placed.z[j], placed.R[j])
            z[k], R[k] = equivalent(x[0], P[0], joint.x[:s], joint.P[:s, :s])
            z[k] += bank.x[row, :s] - x[0]  # predicted for the scan's time, not the measurement's
            if row < others.min():
                after.append((members, joint))
        edges = Decision(
            np.arange(len(parent)), rows, np.arange(len(rows)), np.ones(len(rows)), (found.shared < 0).astype(float)
        )
        bank.update(edges, Scan(found.problem.scan.t, z, R, POSITION_VELOCITY), POSITION_VELOCITY)
        if isinstance(bank, Mixture):  # how targets move relative to each other does not show in their middle
            bank.forget(rows)
        register.history[rows] |= 1
        register.updated_s[rows] = found.problem.scan.t
        for members, joint in after:
            self.correlations.keep(register.id[members], joint, bank.P[members, :s, :s])

    def parts(self, register: Register, bank: Estimator, t: float, ending: Mask) -> Mask:
        """(T,) none: each is a target."""
        return np.zeros(len(register), bool)

    def merge(self, shared: Ints, register: Register, t: float, events: list[Event]) -> None:
        """Unresolved tracks have a common number, which stays while any two of them stay together."""
        there = np.isin(self.correlations.pair, register.id)
        self.correlations.drop(~(there[:, 0] & there[:, 1]))
        merged = np.full(len(register), -1)
        for pair in self.correlations.pair:
            on_it = np.isin(register.id, pair)
            on_it |= (merged >= 0) & np.isin(merged, merged[on_it])
            number = max(merged[on_it].max(), register.merged[on_it].max())
            if number < 0:
                number = self._made
                self._made += 1
            merged[on_it] = number
        joined, alone = (merged >= 0) & (register.merged < 0), (merged < 0) & (register.merged >= 0)
        for number in np.unique(merged[joined]):
            ids = np.unique(register.id[merged == number])
            reason = f"tracks {', '.join(map(str, ids))} are not resolved"
            events.extend(Event.each(t, np.unique(register.id[joined & (merged == number)]), "merge", reason))
        for track, first in zip(*np.unique(register.id[alone], return_index=True), strict=True):
            exchange = register.exchange[alone][first]
            events.append(Event(t, int(track), "split", f"resolved; exchanged with probability {exchange:.3f}"))
        register.merged_since_s[joined], register.merged_since_s[alone] = t, np.nan
        register.merged = merged

    def newcomers(self, born: Ints, view: View | None, register: Register, bank: Estimator) -> Ints:
        """All of them."""
        return born

    def travel(self, register: Register, bank: Estimator, road: Road | None, dt: float) -> Floats:
        """(T,) distances from where the rows began."""
        return register.travel(bank.x.take(bank.model.position, axis=1))

    def _part(self, found: Association, register: Register) -> None:
        """Part the pairs of which a track has a measurement without the other; say how probable an exchange is."""
        parted = np.zeros(len(self.correlations.pair), bool)
        for q, pair in enumerate(self.correlations.pair):
            rows = [np.flatnonzero(register.id == track) for track in pair]
            if not all(len(own) for own in rows):
                continue
            seen = [found.measurement[own] for own in rows]
            shared, every = np.concatenate([found.shared[own] for own in rows]), np.concatenate(seen)
            parted[q] = (shared < 0).all() and (every >= 0).any() and len(np.unique(every)) > 1
            if not parted[q]:
                continue
            exchange = self._exchange(pair, seen)
            for own in rows:
                register.exchange[own] += exchange - 2 * exchange * register.exchange[own]
        self.correlations.drop(parted)

    def _exchange(self, pair: Ints, seen: list[Ints]) -> float:
        """Probability that two tracks have been exchanged, by the measurements `seen` by the rows of each.

        Of several, as possible histories have them, the likeliest are taken.
        """
        placed = self._placed
        assert placed is not None, "the measurements are claimed first"
        rows = [self._predicted[int(track)] for track in pair]
        joint = self.correlations.joint(pair, placed.x[rows], placed.P[rows])
        found = []
        for a in np.unique(seen[0]):
            for b in np.unique(seen[1][seen[1] != a]):
                at = np.array([a, b])
                z = np.where(at[:, None] < 0, np.nan, placed.z[at])
                found.append((np.count_nonzero(at >= 0), exchange_probability(joint, z, placed.R[at])))
        most = max(count for count, _ in found)
        return min(exchange for count, exchange in found if count == most)
