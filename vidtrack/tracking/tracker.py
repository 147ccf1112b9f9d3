"""The tracker: scans in, tracks out. Read this file first."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from vidtrack.associate.adaptive import thresholded
from vidtrack.associate.gate import Gate
from vidtrack.associate.hard import GNN, Associator
from vidtrack.associate.problem import Problem
from vidtrack.associate.shape import Shape
from vidtrack.associate.trust import EQUAL, Trust
from vidtrack.detection.threshold import ThresholdController
from vidtrack.errors import ConfigError, ScanError
from vidtrack.estimate.bank import Estimator
from vidtrack.estimate.kalman import KalmanBank
from vidtrack.estimate.lasting import inflation
from vidtrack.estimate.model import Motion
from vidtrack.estimate.motion import ConstantVelocity
from vidtrack.estimate.sensor import POSITION, Sensor
from vidtrack.estimate.smoother import smoothing_gain
from vidtrack.scan import CONFIRMED, TENTATIVE, Choices, Decision, Event, Floats, Ints, Mask, Scan, Tracks
from vidtrack.tracking.association import Association, at_once, deferred
from vidtrack.tracking.births import pieces
from vidtrack.tracking.border import EXIT_S, Border
from vidtrack.tracking.boxes import absolute, follow, longer
from vidtrack.tracking.choices import choices, evidence, heaviest
from vidtrack.tracking.forest import Deferred, Forest
from vidtrack.tracking.groups import Groups
from vidtrack.tracking.lifecycle import Life, LifeCycle
from vidtrack.tracking.rates import Rate, Rates
from vidtrack.tracking.register import BELIEF, Register
from vidtrack.tracking.road import Road
from vidtrack.tracking.sharing import Sharing
from vidtrack.tracking.snapshot import snapshot
from vidtrack.usable import check_states


class Tracker:
    """Multi-target tracker: predict, gate, associate, update, register, delete.

    model      motion model of every target
    associate  association rule: NN(), GNN(), ..., or one that decides some scans later: MHT(), Split()
    gate       Gate, or the probability of one
    life       confirmation and deletion: LifeCycle(), M of N, or LogRatio(), by the log-likelihood ratio
    groups     how tracks share merged blobs (scans with boxes only); None: they do not
    shape      how the size of boxes counts in the association; None: it does not
    trust      which scores may start a track; None: scores do not count
    road       what traffic teaches about the scene, learnt scan by scan; None: nothing
    estimator  makes the bank of filters from the model
    bounds     (width, height) of the picture; a track that leaves it is deleted; None: no border
    births     whether measurements that belong to no track start one
    detection_probability, clutter_density [per px^2 or m^2]   for weights and existence probability: numbers, arrays
               (B,) with one for each Monte Carlo run, or None: estimated from the scans (`rates` has the estimates)
    threshold  controller of the detection threshold, set for each track and scan from its innovation covariance; P_D
               and clutter density then follow from it, and those given are ignored. None: all measurements are used
    surveyed   area [px^2 or m^2] over which the clutter is estimated; None: the picture, else the measurements' extent
    box_s      time constant [s] with which a track's box follows its blobs' boxes
    exit_s     a track that is leaving over the border is deleted this long [s] after its last evidence
    explain    keep each scan's choices (runner-up and distances) in the snapshot
    smooth     keep in the snapshot what a smoother needs

    Raises ConfigError for numbers out of range, or an association rule that is not an instance.
    """

    STATE = ("t", "bank", "register", "sharing", "forest", "rates", "road")

    def __init__(
        self,
        model: Motion | None = None,
        associate: Associator | Deferred | None = None,
        gate: Gate | float = 0.999,
        life: Life | None = None,
        groups: Groups | None = None,
        shape: Shape | None = None,
        trust: Trust | None = None,
        road: Road | None = None,
        *,
        estimator: Callable[[Motion], Estimator] = KalmanBank,
        bounds: tuple[float, float] | None = None,
        births: bool = True,
        detection_probability: Rate = 0.9,
        clutter_density: Rate = 1e-5,
        threshold: ThresholdController | None = None,
        surveyed: float | None = None,
        box_s: float = 0.3,
        exit_s: float = EXIT_S,
        explain: bool = False,
        smooth: bool = False,
    ) -> None:
        self.model: Motion = model or ConstantVelocity()
        self.associate: Associator = GNN()
        self.forest: Forest | None = None
        if isinstance(associate, str | type):
            raise ConfigError(f"associate is {associate!r}; give an instance, such as GNN()")
        if isinstance(associate, Deferred):
            self.forest = associate.forest()
        elif associate is not None:
            self.associate = associate
        self.gate = gate if isinstance(gate, Gate) else Gate(gate)
        self.life: Life = life or LifeCycle()
        self.shape = shape
        self.trust = trust or EQUAL
        self.road = road
        self.threshold = threshold
        self.births = births
        if surveyed is None and bounds:
            surveyed = bounds[0] * bounds[1]
        self.rates = Rates(detection_probability, clutter_density, surveyed)
        if not box_s > 0:
            raise ConfigError(f"box_s is {box_s}; it must be above zero")
        self.box_s = box_s
        self.exit_s = exit_s
        self.explain = explain
        self.smooth = smooth
        self.bank = estimator(self.model)
        self.register = Register(self.model.dim, smooth)
        self.border = Border(*bounds) if bounds else Border()
        self.sharing = Sharing(groups, box_s) if groups and not self.forest else None
        self.t: float | None = None

    def step(self, scan: Scan) -> Tracks:
        """Take one scan and return all tracks at its time.

        Raises ScanError if the scan is older than the last one, or does not fit the sensor or model.
        """
        events: list[Event] = []
        self.border = self.border.of(scan)
        sensor = scan.sensor or POSITION
        blobs = None if scan.box is None else absolute(scan.box, scan.z)
        dt = self._predict(scan, events)
        problem = self._problem(scan, sensor, blobs)
        problem, decision, shared, hides, free = self._associated(problem, blobs, events)
        taken = heaviest(decision)
        self._update(decision, taken, scan, sensor, blobs, dt)
        if self.sharing and blobs is not None:
            self.sharing.follow(shared, hides, self.bank, self.register, blobs, self.border, scan.t, dt)
        why = self._why(problem, decision, taken) if self.explain else None
        nis = self._weigh_evidence(problem, decision, taken, shared, dt)
        kept = self._delete(scan.t, events)
        if self.sharing:
            self.sharing.regroup(shared[kept], self.register, scan.t, events)
        born = self._register(scan, sensor, blobs, free, events)
        self._confirm(scan.t, events)
        taken = np.concatenate([np.where(shared >= 0, shared, taken)[kept], born])
        nis = np.concatenate([nis[kept], np.full(len(born), np.nan)])
        links = self.register.links() if self.smooth else {}
        more: dict[str, Any] = {"events": tuple(events), "choices": why, **links}
        tracks = self._snapshot(scan.t, self.bank.x, self.bank.P, taken, nis, **more)
        if self.road:
            self.road.learn(tracks)
        return tracks

    def predict(self, t: float) -> Tracks:
        """All tracks predicted to time t; the tracker does not change. Raises ScanError for a time in the past."""
        x, P = self.bank.ahead(self._since_last(t))
        return self._snapshot(t, x, P, np.full(len(x), -1), np.full(len(x), np.nan))

    def remove(self, ids: Ints) -> None:
        """Delete the tracks with these ids."""
        self._keep(~np.isin(self.register.id, ids))

    def add(
        self,
        t: float,
        x: Floats,
        P: Floats,
        run: Ints | None = None,
        box: Floats | None = None,
        ids: Ints | None = None,
    ) -> Ints:
        """Add confirmed tracks with known states x (B, n), P (B, n, n); returns their ids (B,), new unless given.

        Raises ScanError for states or covariances that are none.
        """
        check_states(x, P)
        first, count = len(self.bank), len(x)
        position = list(self.model.position)
        self.bank.insert(x, P, np.ones(count))
        if self.forest:
            self.forest.add(count)
        boxes = np.full((count, 4), np.nan) if box is None else box
        runs = np.zeros(count, np.int64) if run is None else run
        new = self.register.append(t, x[:, position], boxes, BELIEF, runs)
        self.register.id[first:] = new if ids is None else ids
        self.register.next_id = max(self.register.next_id, 1 + int(self.register.id[first:].max(initial=0)))
        self.register.status[first:] = CONFIRMED
        self.t = t if self.t is None else self.t
        return self.register.id[first:].copy()

    def _predict(self, scan: Scan, events: list[Event]) -> float:
        """Move all rows to the scan's time and delete those unseen for too long; returns the time step [s]."""
        t = scan.t
        if len(scan) and scan.sensor is None and scan.z.shape[1] != self.model.dim:
            raise ScanError(f"measurements have {scan.z.shape[1]} components but the model moves in {self.model.dim}")
        dt = self._since_last(t)
        x, P = self.bank.x, self.bank.P
        before = self._boxes() if self.road else None
        self.bank.predict(dt)
        self.t = t
        if self.road and before is not None:
            self.register.box *= self.road.growth(before, self._boxes())
        if self.smooth:
            self._remember(dt, x, P)
        lost = self.life.lost(self.register, t)
        if np.count_nonzero(lost):
            last = dict(zip(self.register.id[lost].tolist(), self.register.updated_s[lost].tolist(), strict=True))
            for track in self._ends(lost):
                events.append(Event(t, int(track), "delete", f"no evidence since {last[int(track)]:.2f} s"))
            self._keep(~lost)
        return dt

    def _remember(self, dt: float, x: Floats, P: Floats) -> None:
        """Keep what a smoother needs: the prediction of the tracks that were shown, and the gain back to x, P."""
        gain = smoothing_gain(P, self.bank.jacobian(dt, x), self.bank.P)
        prior_x = np.where(self._shown(len(x))[:, None], self.bank.x, np.nan)
        self.register.link(prior_x, self.bank.P, gain)

    def _since_last(self, t: float) -> float:
        dt = 0.0 if self.t is None else t - self.t
        if dt < 0:
            raise ScanError(f"{t:.6g} s is before the last scan at {self.t:.6g} s; sort the scans by time")
        return dt

    def _problem(self, scan: Scan, sensor: Sensor, blobs: Floats | None) -> Problem:
        """Which measurements each track may take, and how likely each is."""
        zhat, cov = self.bank.predicted_measurement(sensor)
        self.rates.look(scan)
        problem = Problem.gated(
            self.gate, zhat, cov, scan, *self.rates.of(self.register.run),
            run=self.register.run, label=self.register.label, angles=sensor.angles,
        )  # fmt: skip
        if self.threshold is not None:
            problem = thresholded(problem, self.threshold)
        if self.shape is None or blobs is None:
            return problem
        return problem.having(self.shape.weigh(problem.pairs, self._boxes(), blobs))

    def _associated(self, problem: Problem, blobs: Floats | None, events: list[Event]) -> Association:
        """Assign measurements to tracks, at once or by decisions that wait for later scans."""
        if self.forest:
            return deferred(problem, self.forest, self.trust, self.births, self.register, events)
        claim = catch = None
        confirmed = self.register.status != TENTATIVE
        if self.sharing and blobs is not None:
            claim = partial(self.sharing.claim, self._boxes(), self.bank.hits, self.border, confirmed, blobs)
            catch = partial(self.sharing.catch, self._boxes(), blobs)
        return at_once(problem, self.associate, self.trust, confirmed, claim, catch)

    def _update(
        self, decision: Decision, taken: Ints, scan: Scan, sensor: Sensor, blobs: Floats | None, dt: float
    ) -> None:
        """Update states and boxes with the measurements that the tracks took."""
        register = self.register
        self.bank.update(decision, scan.weakened(inflation(dt)), sensor)
        hit = decision.beta0 < 0.5
        rows = hit.nonzero()[0]
        sure = hit.copy()
        sure[rows] = self.trust.sure(scan)[taken[rows]]
        register.see(hit, sure, scan.t, dt)
        if scan.label is not None:
            told = scan.label[taken[rows]]
            register.label[rows] = np.where(told < 0, register.label[rows], told)
        if blobs is None or scan.box is None:
            return
        share = np.maximum(-np.expm1(-dt / self.box_s), 1.0 / self.bank.hits)
        follow(register.box, scan.box, taken, self.border.cut(blobs), share)
        if self.model.per_size:
            self.bank.scale[rows] = longer(register.box)[rows]

    def _why(self, problem: Problem, decision: Decision, taken: Ints) -> Choices:
        """The choices of the tracks that are shown."""
        why = choices(self.register.id, problem.pairs, decision, taken)
        return why.only(self._shown(problem.rows)) if self.forest else why

    def _shown(self, rows: int) -> Mask:
        """(rows,) whether each of the first rows is shown as a track; all are, unless decisions wait."""
        shown = np.full(rows, self.forest is None)
        if self.forest:
            shown[self.forest.shown[self.forest.shown < rows]] = True
        return shown

    def _weigh_evidence(self, problem: Problem, decision: Decision, taken: Ints, shared: Ints, dt: float) -> Floats:
        """Update the tracks' existence (Bayes' rule in log-odds) and the estimates of P_D and clutter density.

        Returns the normalised innovations squared (T,), NaN for a miss.
        """
        register = self.register
        log_ratio, nis = evidence(problem, decision, taken)
        log_ratio[shared >= 0] = 0.0
        register.believe(log_ratio)
        if self.rates.estimated:
            alone = self._shown(problem.rows) & (shared < 0)
            self.rates.learn(decision, register, alone, problem.inside, problem.measurements, dt)
        return nis

    def _delete(self, t: float, events: list[Event]) -> Mask:
        """Delete tracks that are hopeless, have left, or are part of another vehicle; returns (T,) the rows kept."""
        left = self._left(t)
        hopeless = self.life.hopeless(self.register)
        self.register.move(self._xy(), t)
        idle = self.life.idle(self.register, t)
        parts = self.sharing.passengers(self.register, t) if self.sharing else np.zeros(len(left), bool)
        kept = ~(hopeless | left | parts | idle)
        if np.count_nonzero(kept) < len(kept):
            for gone, why in (
                (hopeless & ~left, self.life.ends),
                (left, "left the picture"),
                (idle & ~left & ~hopeless, "never travelled and stands still"),
                (parts & ~left, "part of the vehicle that it never left"),
            ):
                events.extend(Event.each(t, self._ends(~kept, gone), "delete", why))
            self._keep(kept)
        return kept

    def _left(self, t: float) -> Mask:
        """(T,) tracks without a hit in this scan that are beyond the border, or were leaving when last seen."""
        register = self.register
        left = register.history & 1 == 0
        missed = left.nonzero()[0]
        if len(missed):
            x = self.bank.x[missed]
            xy, v = x.take(self.model.position, axis=1), x.take(self.model.velocity, axis=1)
            going = self.border.leaving(absolute(register.box[missed], xy), v)
            left[missed] = self.border.outside(xy) | going & (t - register.updated_s[missed] > self.exit_s)
        return left

    def _register(self, scan: Scan, sensor: Sensor, blobs: Floats | None, free: Mask, events: list[Event]) -> Ints:
        """Start tentative tracks from measurements that belong to no track; returns the indices of these."""
        born = (free & self.births).nonzero()[0]
        if blobs is not None and self.sharing and len(born):
            born = born[~pieces(blobs[born], self._boxes()[self.register.status != TENTATIVE])]
        if not len(born):
            return born
        box = np.full((len(born), 4), np.nan) if scan.box is None else scan.box[born]
        scale = longer(box) if self.model.per_size and scan.box is not None else np.ones(len(born))
        position, cov = sensor.locate(scan.z[born], scan.R[born])
        self.bank.append(position, cov, scale)
        run = np.zeros(len(born), np.int64) if scan.run is None else scan.run[born]
        label = None if scan.label is None else scan.label[born]
        ids = self.register.append(scan.t, position, box, self.life.birth, run, label)
        for track, j in zip(ids.tolist(), born.tolist(), strict=True):
            events.append(Event(scan.t, track, "birth", f"measurement {j} belongs to no track"))
        return born

    def _confirm(self, t: float, events: list[Event]) -> None:
        """Confirm the tentative tracks that qualify, and set the status of all others by what was seen of them."""
        register = self.register
        if self.forest:
            self.forest.settle(register, t, events)
        if np.count_nonzero(register.status == TENTATIVE):
            size = np.fmax(longer(register.box), self.border.speck)  # NaN where there is no box
            if self.road:
                size = size * self.road.caution(self._xy())
            ready = self.life.confirmed(register, t, register.travel(self._xy()), size)
            if self.forest:
                ready &= self.forest.sure & np.isin(np.arange(len(register)), self.forest.shown)
                register.status[np.isin(register.id, register.id[ready])] = CONFIRMED
            register.status[ready] = CONFIRMED
            events.extend(Event.each(t, register.id[ready], "confirmed", self.life.confirms))
        register.settle()

    def _xy(self) -> Floats:
        """(T, d) the tracks' positions."""
        return self.bank.x.take(self.model.position, axis=1)

    def _boxes(self) -> Floats:
        """(T, 4) the tracks' boxes in the picture."""
        return absolute(self.register.box, self._xy())

    def _ends(self, going: Mask, why: Mask | None = None) -> Ints:
        """Ids of the tracks whose last row is among `going` (T,); with `why` (T,), only those with a row in it."""
        ids = self.register.id
        ended = ids[going if why is None else why]
        return np.setdiff1d(ended, ids[~going]) if self.forest else ended

    def _keep(self, kept: Mask) -> None:
        if self.forest:
            self.forest.keep(kept)
        rows = kept.nonzero()[0]
        self.bank.keep(rows)
        self.register.keep(rows)

    def _snapshot(self, t: float, x: Floats, P: Floats, taken: Ints, nis: Floats, **more: Any) -> Tracks:
        tracks = snapshot(self.register, self.model, t, x, P, taken, nis, **more)
        if not self.forest:
            return tracks
        shown = self.forest.shown
        return tracks.only(shown[np.argsort(self.register.id[shown])])
