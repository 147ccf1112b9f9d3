"""The tracker: scans in, tracks out. The page to read first."""

from __future__ import annotations

import numpy as np

from vidtrack.associate.gate import Gate, Pairs
from vidtrack.associate.hard import GNN, Associator
from vidtrack.errors import ScanError
from vidtrack.estimate.kalman import KalmanBank
from vidtrack.estimate.motion import ConstantVelocity
from vidtrack.estimate.sensor import POSITION, Sensor
from vidtrack.scan import Choices, Decision, Event, Floats, Ints, Scan, Status, Tracks
from vidtrack.tracking.boxes import absolute, best_cover
from vidtrack.tracking.groups import Groups
from vidtrack.tracking.lifecycle import LifeCycle
from vidtrack.tracking.register import Register

BIRTH_EXISTENCE = 0.5
BORDER = 2.0
"""px; a blob this close to the border is cut by it."""
SLOW = 5.0
"""A box follows a blob of another size this many times more slowly."""
ADULT = 5
"""Updates after which a track's box is believed."""
FRAGMENT, NEAR, SMALL = 0.6, 0.25, 0.6
"""A leftover blob starts no track where a tracked vehicle, widened by NEAR of its longer side, covers FRAGMENT of
it, if the blob is smaller than SMALL of the vehicle: it is a piece of it, or of its shadow."""


class Tracker:
    """Multi-target tracker: predict, gate, associate, update, register, delete.

    model      motion model of every target
    associate  association rule (NN(), GNN(), ...)
    gate       Gate, or the probability of one
    life       confirmation and deletion
    groups     how tracks share merged blobs (scans with boxes only); None: they do not
    bounds     (width, height) of the picture; a track that leaves it is deleted; None: no border
    births     whether measurements that belong to no track start one
    detection_probability, clutter_density [per px^2 or m^2]   for the existence probability
    box_s      time constant [s] with which a track's box follows its blobs' boxes
    explain    keep each scan's choices (runner-up and distances) in the snapshot
    """

    def __init__(
        self,
        model: ConstantVelocity | None = None,
        associate: Associator | None = None,
        gate: Gate | float = 0.999,
        life: LifeCycle | None = None,
        groups: Groups | None = None,
        *,
        bounds: tuple[float, float] | None = None,
        births: bool = True,
        detection_probability: float = 0.9,
        clutter_density: float = 1e-5,
        box_s: float = 0.2,
        explain: bool = False,
    ) -> None:
        self.model = model or ConstantVelocity()
        self.associate = associate or GNN()
        self.gate = gate if isinstance(gate, Gate) else Gate(gate)
        self.life = life or LifeCycle()
        self.groups = groups
        self.bounds = bounds
        self.births = births
        self.detection_probability = detection_probability
        self.clutter_density = clutter_density
        self.box_s = box_s
        self.explain = explain
        self.bank = KalmanBank(self.model)
        self.register = Register(self.model.dim)
        self.t: float | None = None
        self._groups_made = 0

    def step(self, scan: Scan) -> Tracks:
        """Take one scan and return all tracks at its time.

        Raises ScanError if the scan is older than the last one, or does not fit the sensor or model.
        """
        events: list[Event] = []
        sensor = scan.sensor or POSITION
        dt = self._elapsed(scan)
        self._predict(scan.t, dt, events)
        pairs = self._gated(scan, sensor)
        decision, shared = self._associated(pairs, scan)
        self._update(decision, shared, scan, sensor, dt)
        self._share(shared, scan, dt, events)
        taken = _heaviest(decision)
        nis = _nis(pairs, taken)
        self._score(pairs, taken)
        choices = _choices(self.register.id, pairs, decision, taken) if self.explain else None
        self._confirm(scan.t, events)
        kept = self._delete(scan.t, taken, events)
        born = self._register(scan, sensor, decision, shared, events)
        taken = np.concatenate([np.where(shared >= 0, shared, taken)[kept], born])
        nis = np.concatenate([nis[kept], np.full(len(born), np.nan)])
        return self._snapshot(scan.t, taken, nis, tuple(events), choices)

    def predict(self, t: float) -> Tracks:
        """All tracks as expected at time t >= the last scan's; changes nothing."""
        x, P = self.bank.ahead(0.0 if self.t is None else t - self.t)
        none = np.full(len(x), -1)
        return self._snapshot(t, none, np.full(len(x), np.nan), (), None, x, P)

    def add(self, t: float, x: Floats, P: Floats, run: Ints | None = None, box: Floats | None = None) -> Ints:
        """Put in confirmed tracks with known states x (B, n), P (B, n, n); returns their ids."""
        count = len(x)
        position = list(self.model.position)
        self.bank.append(x[:, position], P[:, position][:, :, position], np.ones(count))
        self.bank.x[-count:], self.bank.P[-count:] = x, P
        boxes = np.full((count, 4), np.nan) if box is None else box
        runs = np.zeros(count, np.int64) if run is None else run
        ids = self.register.append(t, x[:, position], boxes, BIRTH_EXISTENCE, runs)
        self.register.status[-count:] = Status.CONFIRMED
        self.t = t if self.t is None else self.t
        return ids

    def _elapsed(self, scan: Scan) -> float:
        if len(scan) and scan.sensor is None and scan.z.shape[1] != self.model.dim:
            raise ScanError(f"measurements have {scan.z.shape[1]} components but the model moves in {self.model.dim}")
        dt = 0.0 if self.t is None else scan.t - self.t
        if dt < 0:
            raise ScanError(f"scan at {scan.t:.6g} s is older than the last one at {self.t:.6g} s; sort the scans by time")
        return dt

    def _predict(self, t: float, dt: float, events: list[Event]) -> None:
        """Move all rows to time t; those nobody has seen for too long end here, before they gate anything."""
        self.bank.predict(dt)
        self.t = t
        lost = self.life.lost(self.register, t)
        if lost.any():
            for track, seen in zip(self.register.id[lost], self.register.updated_s[lost], strict=True):
                events.append(Event(t, int(track), "delete", f"no evidence since {seen:.2f} s"))
            self._keep(~lost)

    def _gated(self, scan: Scan, sensor: Sensor) -> Pairs:
        zhat, cov = self.bank.predicted_measurement(sensor)
        return self.gate.pairs(zhat, cov, scan, self.register.run)

    def _associated(self, pairs: Pairs, scan: Scan) -> tuple[Decision, Ints]:
        """Confirmed tracks choose first, then merged ones claim their blobs, then tentative tracks choose.

        Returns the decision and, for each row, the blob it leans on by its edges (-1: none).
        """
        rows, count = len(self.register), len(scan)
        confirmed = self.register.status != Status.TENTATIVE
        first = self.associate.decide(pairs.only(confirmed[pairs.row]), rows, count)
        shared = np.full(rows, -1)
        if self.groups is not None and scan.box is not None:
            predicted = absolute(self.register.box, self.bank.x[:, self.model.position])
            blobs = absolute(scan.box, scan.z)
            taken = _heaviest(first)
            shared = self.groups.blob_of(predicted, taken, confirmed, blobs)
            known = confirmed & (self.bank.hits > ADULT) & ~self._cut(predicted)
            odd = known & (shared < 0) & self.groups.changed(predicted, taken, blobs)
            shared[odd] = taken[odd]
            free = ~self.groups.explained(predicted, shared, blobs)
            free[first.without(shared >= 0).measurement] = False
        else:
            free = np.ones(count, bool)
            free[first.measurement] = False
        self._free = free
        if confirmed.all():
            return first.without(shared >= 0), shared
        second = self.associate.decide(pairs.only(~confirmed[pairs.row] & free[pairs.measurement]), rows, count)
        return first.without(shared >= 0).joined(second), shared

    def _update(self, decision: Decision, shared: Ints, scan: Scan, sensor: Sensor, dt: float) -> None:
        self.bank.update(decision, scan, sensor)
        hit = decision.beta0 < 0.5
        self.register.history = (self.register.history << 1 | hit) & ((1 << 62) - 1)
        self.register.updated_s[hit] = scan.t
        if scan.box is None:
            return
        taken = _heaviest(decision)
        rows = np.flatnonzero(hit)
        new = np.isnan(self.register.box[rows, 0])
        follow = np.maximum(-np.expm1(-dt / self.box_s), 1.0 / self.bank.hits[rows])
        follow[new | self._cut(absolute(scan.box, scan.z)[taken[rows]])] = 1.0
        old = np.where(new[:, None], 0.0, self.register.box[rows])
        self.register.box[rows] = old + follow[:, None] * (scan.box[taken[rows]] - old)
        if self.model.per_size:
            self.bank.scale[rows] = _longer(self.register.box[rows])

    def _share(self, shared: Ints, scan: Scan, dt: float, events: list[Event]) -> None:
        """Update the rows that live on a blob by its edges, and keep the book of who shares with whom."""
        rows = np.flatnonzero(shared >= 0)
        if self.groups is not None and len(rows) and scan.box is not None:
            position = list(self.model.position)
            box = self.register.box[rows]
            predicted = absolute(box, self.bank.x[rows][:, position])
            var = np.diagonal(self.bank.P[rows], axis1=1, axis2=2)[:, position]
            blobs = absolute(scan.box, scan.z)
            z, R, own = self.groups.measure(predicted, box, var, shared[rows], blobs, self._at_border(blobs))
            beta0 = np.ones(len(shared))
            beta0[rows] = 0.0
            edges = Decision(np.arange(len(shared)), rows, np.arange(len(rows)), np.ones(len(rows)), beta0)
            self.bank.update(edges, Scan(scan.t, z, R[:, :, None] * np.eye(2)), POSITION)
            self.register.history[rows[own > 0]] |= 1
            self.register.updated_s[rows[own > 0]] = scan.t
            before = predicted - np.pad(dt * self.bank.x[rows][:, self.model.velocity], ((0, 0), (0, 2)))
            self._enter(rows, before, blobs[shared[rows]])
            self._reshape(rows, shared, scan, dt)
        self._regroup(shared, scan.t, events)

    def _enter(self, rows: Ints, before: Floats, blobs: Floats) -> None:
        """A vehicle that was cut by the border, and whose blob still is, reaches to the border: the rest comes in.

        rows (G,), before (G, 4) their boxes a scan ago, blobs (G, 4) theirs now.
        """
        both = self._at_border(before) & self._at_border(blobs)
        if not both.any():
            return
        box = absolute(self.register.box[rows], self.bank.x[rows][:, self.model.position])
        far = box[:, :2] + box[:, 2:]
        near = np.where(both[:, :2], np.minimum(box[:, :2], 0.0), box[:, :2])
        far = np.where(both[:, 2:], np.maximum(far, self.bounds), far)
        self.register.box[rows] = np.hstack([near - self.bank.x[rows][:, self.model.position], far - near])

    def _reshape(self, rows: Ints, shared: Ints, scan: Scan, dt: float) -> None:
        """The box of a track alone on its blob follows it slowly: if the blob stays as it is, the vehicle is so."""
        alone = rows[np.bincount(shared[rows])[shared[rows]] == 1]
        xy = self.bank.x[alone][:, self.model.position]
        seen = absolute(scan.box, scan.z)[shared[alone]]
        seen[:, :2] -= xy
        self.register.box[alone] += -np.expm1(-dt / (SLOW * self.box_s)) * (seen - self.register.box[alone])

    def _regroup(self, shared: Ints, t: float, events: list[Event]) -> None:
        """A group keeps its number and its start for as long as any of its members stay together."""
        group = np.full(len(shared), -1)
        if not ((shared >= 0).any() or (self.register.group >= 0).any()):
            return
        blobs, count = np.unique(shared[shared >= 0], return_counts=True)
        for blob in blobs[count > 1]:
            members = np.flatnonzero(shared == blob)
            number = self.register.group[members].max()
            if number < 0 or (group == number).any():
                number = self._groups_made
                self._groups_made += 1
            group[members] = number
            joined = members[self.register.group[members] != number]
            self.register.group_since_s[joined] = t
            others = ", ".join(str(i) for i in self.register.id[members])
            events.extend(Event(t, int(self.register.id[row]), "merge", f"tracks {others} share one blob") for row in joined)
        for row in np.flatnonzero((group < 0) & (self.register.group >= 0)):
            events.append(Event(t, int(self.register.id[row]), "split", "alone on its blob again"))
            self.register.group_since_s[row] = np.nan
        self.register.group = group

    def _score(self, pairs: Pairs, taken: Ints) -> None:
        """Existence probability: Bayes with the likelihood ratio of the hit or the miss."""
        ratio = np.full(len(taken), 1 - self.detection_probability * self.gate.probability)
        chosen = np.flatnonzero(pairs.measurement == taken[pairs.row])
        dim = self.model.dim
        log_n = -0.5 * (pairs.d2[chosen] + pairs.log_s[chosen] + dim * np.log(2 * np.pi))
        ratio[pairs.row[chosen]] = self.detection_probability * np.exp(log_n) / self.clutter_density
        ratio[self.register.group >= 0] = 1.0
        odds = self.register.existence / (1 - self.register.existence) * ratio
        self.register.existence = np.clip(odds / (1 + odds), 1e-9, 1 - 1e-9)

    def _confirm(self, t: float, events: list[Event]) -> None:
        size = np.nan_to_num(_longer(self.register.box))
        ready = self.life.confirmed(self.register, t, self.bank.x[:, self.model.position], size)
        self.register.status[ready] = Status.CONFIRMED
        reason = f"{self.life.confirm_hits} hits of {self.life.confirm_window}"
        events.extend(Event(t, int(track), "confirmed", reason) for track in self.register.id[ready])
        seen = self.register.history & 1 == 1
        known = self.register.status != Status.TENTATIVE
        self.register.status[known] = np.where(seen[known], Status.CONFIRMED, Status.COASTING)
        self.register.status[self.register.group >= 0] = Status.MERGED

    def _delete(self, t: float, taken: Ints, events: list[Event]) -> np.ndarray:
        """Drop the rows that are not believed any more; returns the mask of those kept."""
        hopeless = self.life.hopeless(self.register)
        left = self._leaving() & (self.register.history & 1 == 0)
        for gone, reason in ((hopeless, "too many misses before confirmation"), (left & ~hopeless, "left the picture")):
            events.extend(Event(t, int(track), "delete", reason) for track in self.register.id[gone])
        kept = ~(hopeless | left)
        if not kept.all():
            self._keep(kept)
        return kept

    def _leaving(self) -> np.ndarray:
        """(T,) rows beyond the border, or cut by it on their way out."""
        if self.bounds is None:
            return np.zeros(len(self.register), bool)
        xy, v = self.bank.x[:, self.model.position], self.bank.x[:, self.model.velocity]
        near = absolute(self.register.box, xy)[:, :2]
        far = near + self.register.box[:, 2:]
        out = (xy < 0) | (xy > self.bounds) | ((near < BORDER) & (v < 0)) | ((far > np.subtract(self.bounds, BORDER)) & (v > 0))
        return out[:, 0] | out[:, 1]

    def _pieces(self, blobs: Floats) -> np.ndarray:
        """(M,) blobs that are pieces of a vehicle already tracked."""
        known = self.register.status != Status.TENTATIVE
        tracked = absolute(self.register.box, self.bank.x[:, self.model.position])[known]
        margin = NEAR * _longer(tracked)[:, None]
        vehicle, share = best_cover(blobs, tracked + margin * [-1, -1, 2, 2])
        piece = (vehicle >= 0) & (share >= FRAGMENT)
        piece[piece] = _area(blobs[piece]) < SMALL * _area(tracked[vehicle[piece]])
        return piece

    def _cut(self, box: Floats) -> np.ndarray:
        """(N,) boxes that the picture's border cuts: their extent changes faster than any vehicle's."""
        return self._at_border(box).any(axis=1)

    def _at_border(self, box: Floats) -> np.ndarray:
        """(N, 4) which sides (left, top, right, bottom) of boxes lie on the picture's border."""
        if self.bounds is None:
            return np.zeros((len(box), 4), bool)
        left, top, width, height = box.T
        right, bottom = self.bounds[0] - BORDER, self.bounds[1] - BORDER
        return np.column_stack([left < BORDER, top < BORDER, left + width > right, top + height > bottom])

    def _register(self, scan: Scan, sensor: Sensor, decision: Decision, shared: Ints, events: list[Event]) -> Ints:
        """Start tentative tracks from measurements that belong to nobody; returns their indices."""
        free = self._free.copy()
        free[decision.measurement] = False
        if scan.box is not None and self.groups is not None and free.any():
            free[free] = ~self._pieces(absolute(scan.box[free], scan.z[free]))
        born = np.flatnonzero(free) if self.births else np.empty(0, np.int64)
        box = np.full((len(born), 4), np.nan) if scan.box is None else scan.box[born]
        scale = _longer(box) if self.model.per_size and scan.box is not None else np.ones(len(born))
        position, cov = sensor.locate(scan.z[born], scan.R[born])
        self.bank.append(position, cov, scale)
        run = np.zeros(len(born), np.int64) if scan.run is None else scan.run[born]
        ids = self.register.append(scan.t, position, box, BIRTH_EXISTENCE, run)
        events.extend(Event(scan.t, int(i), "birth", f"measurement {j} belongs to no track") for i, j in zip(ids, born, strict=True))
        return born

    def _keep(self, rows: np.ndarray) -> None:
        self.bank.keep(rows)
        self.register.keep(rows)

    def _snapshot(
        self, t: float, taken: Ints, nis: Floats, events: tuple[Event, ...], choices: Choices | None,
        x: Floats | None = None, P: Floats | None = None,
    ) -> Tracks:  # fmt: skip
        register = self.register
        x = self.bank.x if x is None else x
        return Tracks(
            t=t,
            id=register.id.copy(),
            status=register.status.copy(),
            x=x.copy(),
            P=(self.bank.P if P is None else P).copy(),
            box=absolute(register.box, x[:, self.model.position]) if self.model.dim >= 2 else register.box.copy(),
            group=register.group.copy(),
            group_since_s=register.group_since_s.copy(),
            age_s=t - register.born_s,
            existence=register.existence.copy(),
            measurement=taken,
            nis=nis,
            position=self.model.position,
            velocity=self.model.velocity,
            run=register.run.copy(),
            events=events,
            choices=choices,
        )


def _longer(box: Floats) -> Floats:
    """(N,) longer sides of boxes (N, 4)."""
    return np.maximum(box[:, 2], box[:, 3])


def _area(box: Floats) -> Floats:
    return box[:, 2] * box[:, 3]


def _heaviest(decision: Decision) -> Ints:
    """(K,) measurement of the largest weight in each row, -1 for none."""
    best = np.full(len(decision.parent), -1)
    order = np.argsort(decision.beta, kind="stable")
    best[decision.row[order]] = decision.measurement[order]
    return best


def _nis(pairs: Pairs, taken: Ints) -> Floats:
    """(T,) normalised innovation squared of the chosen pairs."""
    nis = np.full(len(taken), np.nan)
    chosen = pairs.measurement == taken[pairs.row]
    nis[pairs.row[chosen]] = pairs.d2[chosen]
    return nis


def _choices(ids: Ints, pairs: Pairs, decision: Decision, taken: Ints) -> Choices:
    """Who was chosen, how far it was, and who came second."""
    rows = len(ids)
    weight, d2, runner, runner_d2 = np.zeros(rows), np.full(rows, np.nan), np.full(rows, -1), np.full(rows, np.nan)
    np.maximum.at(weight, decision.row, decision.beta)
    chosen = pairs.measurement == taken[pairs.row]
    d2[pairs.row[chosen]] = pairs.d2[chosen]
    others = np.flatnonzero(~chosen)
    order = others[np.argsort(-pairs.d2[others], kind="stable")]
    runner[pairs.row[order]] = pairs.measurement[order]
    runner_d2[pairs.row[order]] = pairs.d2[order]
    return Choices(ids.copy(), taken.copy(), weight, d2, pairs.limit.copy(), runner, runner_d2)
