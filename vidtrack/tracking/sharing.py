"""Shared blobs: which tracks are on which blob, since when, and the update of these tracks by its edges."""

from __future__ import annotations

import numpy as np

from vidtrack.estimate.bank import Estimator
from vidtrack.estimate.lasting import inflation
from vidtrack.estimate.sensor import POSITION
from vidtrack.scan import Decision, Event, Floats, Ints, Mask, Scan
from vidtrack.tracking.border import Border
from vidtrack.tracking.boxes import absolute, overlapping
from vidtrack.tracking.groups import Groups
from vidtrack.tracking.register import Register

SETTLED = 5
"""Updates after which a track's box is reliable."""
SLOW = 5.0
"""A box follows a blob of another size this many times more slowly than its own."""


class Sharing:
    """Keeps tracks on the blobs they share. All blobs are (M, 4) boxes in the picture."""

    STATE = ("_made",)

    def __init__(self, groups: Groups, box_s: float) -> None:
        self._groups = groups
        self._box_s = box_s
        self._made = 0

    def claim(
        self, predicted: Floats, hits: Ints, border: Border, confirmed: Mask, blobs: Floats, taken: Ints
    ) -> tuple[Ints, Mask]:
        """Which tracks are updated by the edges of a blob, and which blobs are larger than their tracks account for.

        predicted (T, 4) boxes, hits (T,) updates so far, taken (T,) measurement of each track or -1.
        Returns (T,) the blob or -1, and (M,) blobs that may hide a vehicle without a track.
        """
        whole = (hits > SETTLED) & ~border.cut(predicted)
        return self._groups.share(predicted, taken, confirmed, whole, blobs, border.pixel)

    def catch(self, predicted: Floats, blobs: Floats, idle: Mask, free: Mask) -> Ints:
        """(T,) the blob that a track (T,) without a measurement overlaps most, if that is free (M,); -1: none.

        The blob's shape has changed so much that its centroid left the gate; it is still where the vehicle is.
        """
        return overlapping(predicted, blobs, idle, free, self._groups.overlap)

    def follow(
        self,
        shared: Ints,
        hides: Mask,
        bank: Estimator,
        register: Register,
        blobs: Floats,
        border: Border,
        t: float,
        dt: float,
    ) -> None:
        """Update the tracks on shared blobs (T,) by the edges they can claim; hides (M,) as `claim` gave it."""
        leans = shared >= 0
        rows = leans.nonzero()[0]
        if not len(rows):
            return
        position, velocity = bank.model.position, bank.model.velocity
        x, box, on = bank.x[rows], register.box[rows], shared[rows]
        predicted = absolute(box, x.take(position, axis=1))
        before = absolute(predicted, -dt * x.take(velocity, axis=1))
        var = bank.P.diagonal(axis1=1, axis2=2)[rows].take(position, axis=1)
        cut = border.sides(blobs)
        z, R, own = self._groups.measure(predicted, box, var, on, blobs, cut, hides, border.pixel)

        lost = (own == 0) & (np.bincount(on, minlength=len(blobs))[on] == 1)
        self._centre(predicted[lost], blobs[on[lost]], box[lost], z, R, lost)
        own[lost] = 1

        beta0 = (~leans).astype(float)
        edges = Decision(np.arange(len(shared)), rows, np.arange(len(rows)), np.ones(len(rows)), beta0)
        bank.update(edges, Scan(t, z, inflation(dt) * R[:, :, None] * np.eye(2)), POSITION)
        told = rows[own > 0]
        register.history[told] |= 1
        register.updated_s[told] = t

        # A vehicle that the border cut, and whose blob it still cuts, reaches to the border: the rest comes in.
        xy = bank.x[rows].take(position, axis=1)
        box = absolute(border.reaching(absolute(box, xy), border.sides(before) & cut[on]), -xy)
        alone = (np.bincount(on)[on] == 1) & ~hides[on]  # if its blob stays as it is, the vehicle is so
        box[alone] += -np.expm1(-dt / (SLOW * self._box_s)) * (absolute(blobs[on[alone]], -xy[alone]) - box[alone])
        register.box[rows] = box

    @staticmethod
    def _centre(predicted: Floats, blob: Floats, box: Floats, z: Floats, R: Floats, rows: Mask) -> None:
        """Measure rows (G,) whose blob shows no edge of theirs by its middle, which is as wrong as its size is."""
        z[rows] = blob[:, :2] + blob[:, 2:] / 2 - box[:, :2] - box[:, 2:] / 2
        R[rows] = (0.5 * (blob[:, 2:] - predicted[:, 2:])) ** 2 + (0.1 * predicted[:, 2:]) ** 2 + 1.0

    def passengers(self, register: Register, t: float) -> Mask:
        """(T,) members that were hardly ever seen alone and do not leave their group: parts of another member."""
        strange = (register.group >= 0) & (register.alone_s < self._groups.known_s)
        if not np.count_nonzero(strange):
            return strange
        for number in np.unique(register.group[strange]):
            members = np.flatnonzero(register.group == number)
            strange[members[register.alone_s[members].argmax()]] = False
        return strange & (t - register.group_since_s > self._groups.part_s)

    def regroup(self, shared: Ints, register: Register, t: float, events: list[Event]) -> None:
        """A group keeps its number and its start for as long as any of its members stay together."""
        on = shared[shared >= 0]
        if not (len(on) or np.count_nonzero(register.group >= 0)):
            return
        group = np.full(len(shared), -1)
        for blob in (np.bincount(on) > 1).nonzero()[0]:
            members = (shared == blob).nonzero()[0]
            number = register.group[members].max()
            if number < 0 or np.count_nonzero(group == number):
                number = self._made
                self._made += 1
            group[members] = number
            joined = members[register.group[members] != number]
            if not len(joined):
                continue
            register.group_since_s[joined] = t
            reason = f"tracks {', '.join(str(i) for i in register.id[members])} share one blob"
            events.extend(Event.each(t, register.id[joined], "merge", reason))
        alone = ((group < 0) & (register.group >= 0)).nonzero()[0]
        register.group_since_s[alone] = np.nan
        events.extend(Event.each(t, register.id[alone], "split", "alone on its blob again"))
        register.group = group
