"""The occlusion model: tracks whose vehicles merge into one blob continue, and are updated by its edges.

A confirmed track without a measurement of its own, whose predicted box lies on a blob, shares that blob with the other
tracks on it. So does a track whose blob has suddenly become much larger or smaller than the vehicle. The blob's
centroid measures none of the vehicles, but its edges do: the left edge is that of the leftmost vehicle, and so on.
Each track is updated by its own edges and otherwise predicted by its motion model, so that it keeps its identity when
the blob splits.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from vidtrack.arrays.types import Floats, Ints, Mask
from vidtrack.associate.problem import Problem
from vidtrack.decision import Decision, Event
from vidtrack.errors import ConfigError
from vidtrack.estimate.bank import Estimator
from vidtrack.estimate.noise import as_if_new, middle_variance
from vidtrack.estimate.sensor import POSITION
from vidtrack.scan import Scan
from vidtrack.tracking.association import Association
from vidtrack.tracking.births import NEAR, SMALL, pieces
from vidtrack.tracking.boxes import absolute, area, around, overlapping
from vidtrack.tracking.occlusion.aboard import go_along
from vidtrack.tracking.occlusion.claims import claims
from vidtrack.tracking.occlusion.edges import from_edges
from vidtrack.tracking.occlusion.sharing import Exclusive
from vidtrack.tracking.picture.picture import View
from vidtrack.tracking.picture.road import Road
from vidtrack.tracking.register import Register
from vidtrack.tracks import TENTATIVE

SETTLED = 5
"""Updates after which a track's box is reliable."""
SLOW = 5.0
"""A box follows a blob of another size this many times more slowly than its own."""
ALONE = Exclusive()
"""The model for measurements without extent."""


@dataclass(slots=True)
class Occlusion:
    """How tracks share blobs. It numbers what is merged: each tracker needs its own.

    cover  share of a track's predicted box that a blob must cover to carry it
    edge   standard deviation of a blob's edge, as a share of the track's box side
    gate   standard deviations within which an edge is accepted as the track's; half of it where the blob
           hides somebody whose edge it may be
    growth a blob whose area is more than this many times the predicted box, or less than the inverse,
           is not the vehicle alone or not all of it
    known_s, part_s   a track seen alone for less than known_s that stays merged for part_s was never a vehicle
           but a part of one
    along     whether a track that goes along with a larger one is a part of it, if it does so for along_s and for
           along_share of its life
    overlap least intersection over union of a track with a blob that it continues on, whatever its shape

    Raises ConfigError for a cover out of range.
    """

    cover: float = 0.5
    edge: float = 0.1
    gate: float = 2.0
    growth: float = 2.5
    known_s: float = 0.4
    part_s: float = 1.0
    along: bool = True
    along_s: float = 0.6
    along_share: float = 0.5
    overlap: float = 0.3
    _made: int = field(default=0, init=False)

    STATE = ("_made",)

    def __post_init__(self) -> None:
        if not 0 < self.cover <= 1:
            raise ConfigError(f"occlusion cover is {self.cover}; it must lie in 0..1")

    def unresolved(self, problem: Problem, shown: Mask, register: Register, bank: Estimator, dt: float) -> Ints:
        """(T,) none: blobs have edges, and are claimed after the association."""
        return ALONE.unresolved(problem, shown, register, bank, dt)

    def claim(self, view: View | None, taken: Ints, confirmed: Mask, count: int) -> tuple[Ints, Mask]:
        """(T,) the blob whose edges update each track, -1: none; (M,) blobs that may hide a vehicle without a track.

        The edges count where a track shares its blob with others, lies on a blob that it was not assigned, or where
        its blob no longer fits the vehicle.
        """
        if view is None:
            return ALONE.claim(view, taken, confirmed, count)
        reliable = (view.hits > SETTLED) & ~view.border.cut(view.predicted)
        return claims(
            view.predicted, taken, confirmed, reliable, view.blobs,
            view.blobs[:, 0].argsort(kind="stable"), self.cover, self.growth, self.edge, view.border.pixel,
        )  # fmt: skip

    def catch(self, view: View | None, taken: Ints, shared: Ints, free: Mask) -> tuple[Ints, Mask]:
        """`shared` (T,) and `free` (M,) after tracks that got nothing took the free blob that each overlaps most.

        The blob's shape has changed so much that its centroid left the gate; it is still where the vehicle is.
        """
        if view is None:
            return shared, free
        idle = (taken < 0) & (shared < 0)
        if not np.count_nonzero(idle):
            return shared, free
        untaken = free & (np.bincount(shared[shared >= 0], minlength=len(free)) == 0)
        caught = overlapping(view.predicted, view.blobs, idle.nonzero()[0], untaken.nonzero()[0], self.overlap)
        free[caught[caught >= 0]] = False
        return np.where(caught >= 0, caught, shared), free

    def update(self, found: Association, view: View | None, register: Register, bank: Estimator, dt: float) -> None:
        """Update the tracks on shared blobs by the edges they can claim, dt seconds after the last scan."""
        shared, hides, t = found.shared, found.hides, found.problem.scan.t
        leans = shared >= 0
        rows = leans.nonzero()[0]
        if view is None or not len(rows):
            return
        blobs, border = view.blobs, view.border
        position, velocity = bank.model.position, bank.model.velocity
        x, box, on = bank.x[rows], register.box[rows], shared[rows]
        predicted = absolute(box, x.take(position, axis=1))
        before = absolute(predicted, -dt * x.take(velocity, axis=1))
        var = bank.P.diagonal(axis1=1, axis2=2)[rows].take(position, axis=1)
        cut = border.sides(blobs)
        z, R, own = from_edges(predicted, box, var, on, blobs, cut, hides, self.gate, self.edge, border.pixel)

        lost = (own == 0) & (np.bincount(on, minlength=len(blobs))[on] == 1)  # measured by the middle of its blob
        blob = blobs[on[lost]]
        z[lost] = blob[:, :2] + blob[:, 2:] / 2 - box[lost, :2] - box[lost, 2:] / 2
        R[lost] = middle_variance(blob[:, 2:], predicted[lost, 2:])
        own[lost] = 1

        beta0 = (~leans).astype(float)
        edges = Decision(np.arange(len(shared)), rows, np.arange(len(rows)), np.ones(len(rows)), beta0)
        bank.update(edges, Scan(t, z, as_if_new(R, dt)[:, :, None] * np.eye(2)), POSITION)
        told = rows[own > 0]
        register.history[told] |= 1
        register.updated_s[told] = t

        # A vehicle that the border cut, and whose blob it still cuts, reaches to the border: the rest comes in.
        xy = bank.x[rows].take(position, axis=1)
        box = absolute(border.reaching(absolute(box, xy), border.sides(before) & cut[on]), -xy)
        alone = (np.bincount(on)[on] == 1) & ~hides[on]  # if its blob stays as it is, the vehicle is so
        box[alone] += -np.expm1(-dt / (SLOW * view.box_s)) * (absolute(blobs[on[alone]], -xy[alone]) - box[alone])
        register.box[rows] = box

    def parts(self, register: Register, bank: Estimator, t: float, ending: Mask) -> Mask:
        """(T,) tracks that are parts of another one's vehicle.

        Merged ones that were hardly ever seen alone and do not split off, and those that go along with a larger one
        that does not end.
        """
        return self._never_alone(register, t, ending) | self._go_along(register, bank, t, ending)

    def _never_alone(self, register: Register, t: float, ending: Mask) -> Mask:
        strange = (register.merged >= 0) & (register.alone_s < self.known_s)
        if not np.count_nonzero(strange):
            return strange
        alone_s = np.where(ending, -1.0, register.alone_s)  # one that stays is the vehicle
        for number in np.unique(register.merged[strange]):
            together = np.flatnonzero(register.merged == number)
            strange[together[alone_s[together].argmax()]] = False
        return strange & (t - register.merged_since_s > self.part_s)

    def _go_along(self, register: Register, bank: Estimator, t: float, ending: Mask) -> Mask:
        if not self.along or len(register) < 2:
            return np.zeros(len(register), bool)
        stays = (register.history & 1 == 1) & ~ending
        return go_along(
            around(bank.x, register.box), register.id, register.status != TENTATIVE, stays,
            register.born_s, register.rest_s, register.host, register.seat, t, self.along_s, self.along_share,
        )  # fmt: skip

    def merge(self, shared: Ints, register: Register, t: float, events: list[Event]) -> None:
        """Merged tracks keep their common number and its start for as long as any of them stay together."""
        on = shared[shared >= 0]
        if not (len(on) or np.count_nonzero(register.merged >= 0)):
            return
        merged = np.full(len(shared), -1)
        for blob in (np.bincount(on) > 1).nonzero()[0]:
            on_it = (shared == blob).nonzero()[0]
            number = register.merged[on_it].max()
            if number < 0 or np.count_nonzero(merged == number):
                number = self._made
                self._made += 1
            merged[on_it] = number
            joined = on_it[register.merged[on_it] != number]
            if not len(joined):
                continue
            register.merged_since_s[joined] = t
            reason = f"tracks {', '.join(str(i) for i in register.id[on_it])} share one blob"
            events.extend(Event.each(t, register.id[joined], "merge", reason))
        alone = ((merged < 0) & (register.merged >= 0)).nonzero()[0]
        register.merged_since_s[alone] = np.nan
        events.extend(Event.each(t, register.id[alone], "split", "alone on its blob again"))
        register.merged = merged

    def newcomers(self, born: Ints, view: View | None, register: Register, bank: Estimator) -> Ints:
        """Those of the blobs born (B,) that are no pieces of known vehicles."""
        if view is None:
            return born
        known = around(bank.x, register.box)[register.status != TENTATIVE]
        return born[pieces(view.blobs[born], known) < 0]

    def travel(self, register: Register, bank: Estimator, road: Road | None, dt: float) -> Floats:
        """(T,) how far each row travelled by itself since it began; dt seconds after the last scan.

        A row that is small beside a vehicle may be a piece of it, or of its shadow. It counts what it travelled apart
        from the vehicle too, by half if it began there, and nothing while it is small for a vehicle at its place.
        """
        xy = bank.x.take(bank.model.position, axis=1)
        travel = register.travel(xy)
        rows = (register.status == TENTATIVE).nonzero()[0]
        if not len(rows):
            return travel
        known = (register.status != TENTATIVE).nonzero()[0]
        box = around(bank.x, register.box)
        vehicle = pieces(box[rows], box[known], NEAR)
        small = rows[vehicle >= 0]
        if len(small):
            vehicle = known[vehicle[vehicle >= 0]]
            moved = dt * bank.x[vehicle].take(bank.model.velocity, axis=1)
            register.tow(small, moved * (1.0 + register.inward[vehicle]) / (1.0 + register.inward[small]))
            register.beside[small] |= register.history[small] == 1
        apart = np.where(register.beside, 0.5, 1.0) * register.travel_apart(xy)
        if len(small) and road:
            apart[small[area(box[small]) < SMALL * road.sizes.area(box[small])]] = -np.inf
        return np.where(register.status == TENTATIVE, np.minimum(travel, apart), travel)
