"""The tracker: scans in, tracks out. Read this file first."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from vidtrack.amplitude.threshold import ThresholdController
from vidtrack.arrays.checks import check_states
from vidtrack.arrays.rows import each, no_index
from vidtrack.arrays.types import Floats, Ints, Mask
from vidtrack.associate.adaptive import thresholded
from vidtrack.associate.gate import Gate
from vidtrack.associate.hard import GNN, Associator
from vidtrack.associate.problem import Problem
from vidtrack.associate.two_stage import SINGLE_STAGE, TwoStage
from vidtrack.decision import Choices, Event
from vidtrack.errors import ConfigError, ScanError
from vidtrack.estimate.bank import Estimator, Mixture
from vidtrack.estimate.kalman import KalmanBank
from vidtrack.estimate.motion.model import Motion
from vidtrack.estimate.motion.velocity import ConstantVelocity
from vidtrack.estimate.noise import for_update
from vidtrack.estimate.sensor import POSITION
from vidtrack.estimate.smoother import smoothing_gain
from vidtrack.scan import Scan
from vidtrack.tracking.association import Association, Timing
from vidtrack.tracking.boxes import absolute, around, longer
from vidtrack.tracking.choices import choices, evidence
from vidtrack.tracking.deferred.deferred import Deferred
from vidtrack.tracking.deferred.forest import ForestRule
from vidtrack.tracking.immediate import Immediate
from vidtrack.tracking.lifecycle import Life, LifeCycle
from vidtrack.tracking.occlusion.occlusion import Occlusion
from vidtrack.tracking.occlusion.sharing import Exclusive, Sharing
from vidtrack.tracking.picture.picture import Picture, Surroundings, View
from vidtrack.tracking.picture.road import Road
from vidtrack.tracking.rates import Rate, Rates
from vidtrack.tracking.register import BELIEF, Register
from vidtrack.tracking.snapshot import snapshot
from vidtrack.tracking.station import Sight, Station, Stations
from vidtrack.tracks import CONFIRMED, TENTATIVE, Tracks


class Outcome(NamedTuple):
    """Result of a scan for each track.

    measurement  (T,) alone or shared; -1: none
    nis          (T,) normalised innovation squared; NaN: none
    choices      of the output tracks, including those that end in the scan; None without `explain`
    """

    measurement: Ints
    nis: Floats
    choices: Choices | None

    def after(self, kept: Mask, born: Ints) -> Outcome:
        """The outcome of the tracks kept (T,), then of those born from measurements (B,)."""
        measurement, nis = self.measurement, self.nis
        if np.count_nonzero(kept) < len(kept):
            measurement, nis = measurement[kept], nis[kept]
        if len(born):
            measurement, nis = np.concatenate([measurement, born]), np.concatenate([nis, each(np.nan, len(born))])
        return Outcome(measurement, nis, self.choices)


class Tracker:
    """Multi-target tracker: predict, gate, associate, update, delete, register.

    model      motion model of every target
    associate  association rule: NN(), GNN(), ..., or one that decides some scans later: MHT(), Split()
    gate       Gate, or the probability of one
    life       confirmation and deletion: LifeCycle(), M of N, or LogRatio(), by the log-likelihood ratio
    picture    Picture() for measurements with boxes, with its bounds, or NoPicture() for points
    sharing    model for measurements of several targets: Exclusive() (none), Occlusion() for blobs (not with MHT and
               Split), or Unresolved() for points
    two_stage  association by score in two stages; None: scores do not count
    estimator  makes the bank of filters from the model
    births     whether measurements that belong to no track start one
    detection_probability, clutter_density [per px^2 or m^2]   for weights and existence probability: numbers, arrays
               (B,) with one for each Monte Carlo run, or None: estimated from the scans (`rates` has the estimates)
    threshold  controller of the detection threshold, set for each track and scan from its innovation covariance; P_D
               and clutter density then follow from it, and those given are ignored. None: all measurements are used
    surveyed   area [px^2 or m^2] over which the clutter is estimated; None: the picture, else the measurements' extent
    stations   several sensors, each with its own P_D, clutter density and coverage; scans say by number whose they are.
               None: one, with the P_D and clutter density given
    explain    keep each scan's choices (runner-up and distances) in the snapshot
    smooth     keep in the snapshot what a smoother needs

    Raises ConfigError for numbers out of range, an association rule that is not an instance, or one that does not go
    with the sharing, and for tracks that might never end.
    """

    STATE = ("t", "bank", "register", "timing", "sharing", "stations", "picture")

    def __init__(
        self,
        model: Motion | None = None,
        associate: Associator | ForestRule | None = None,
        gate: Gate | float = 0.999,
        life: Life | None = None,
        picture: Surroundings | None = None,
        sharing: Sharing | None = None,
        two_stage: TwoStage | None = None,
        *,
        estimator: Callable[[Motion], Estimator] = KalmanBank,
        births: bool = True,
        detection_probability: Rate = 0.9,
        clutter_density: Rate = 1e-5,
        threshold: ThresholdController | None = None,
        surveyed: float | None = None,
        stations: Sequence[Station] | None = None,
        explain: bool = False,
        smooth: bool = False,
    ) -> None:
        self.model: Motion = model or ConstantVelocity()
        self.gate = gate if isinstance(gate, Gate) else Gate(gate)
        self.life: Life = life or LifeCycle()
        self.picture: Surroundings = picture or Picture()
        self.sharing: Sharing = sharing or Exclusive()
        self.two_stage = two_stage or SINGLE_STAGE
        self.timing = self._timing(associate or GNN(), births)
        self.threshold = threshold
        space = self.picture.area if surveyed is None else surveyed
        self.stations = Stations(stations or [Station(Rates(detection_probability, clutter_density, space))])
        if self.stations.unseeing and self.life.coast_s is None:
            raise ConfigError("a station may not see a target, whose track would never end: give the life coast_s")
        self.explain = explain
        self.smooth = smooth
        self.bank = estimator(self.model)
        self._mixture = self.bank if isinstance(self.bank, Mixture) else None  # slow to ask in every step
        self.register = Register(self.model.dim, smooth, len(self.stations))
        self.t: float | None = None
        self.number: Callable[[Scan, Ints], Ints] | None = None
        """Gives ids to the tracks that measurements of a scan begin; None: they are numbered on."""

    def step(self, scan: Scan) -> Tracks:
        """Take one scan and return all tracks at its time.

        Raises ScanError if the scan is older than the last one, or does not fit the sensor or model.
        """
        events: list[Event] = []
        dt, since = self._predict(scan, events), self.stations.take(scan)
        view = self.picture.view(scan, self.register, self.bank)
        sight = self.stations.sight(scan, self.bank)
        problem = self._gate(scan, view, sight, since)
        found = self._associate(problem, view, dt, events)
        outcome = self._update(found, scan, view, sight.of(found.decision.parent), dt, since)
        kept = self._delete(found, scan.t, events)
        born = self._register(found, scan, view, dt, events)
        return self._tracks(scan.t, outcome.after(kept, born), events)

    def predict(self, t: float) -> Tracks:
        """All tracks predicted to time t; the tracker does not change. Raises ScanError for a time in the past."""
        x, P = self.bank.ahead(self._since_last(t))
        return self._snapshot(t, x, P, no_index(len(x)), each(np.nan, len(x)))

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
        self.timing.add(count)
        boxes = np.full((count, 4), np.nan) if box is None else box
        runs = np.zeros(count, np.int64) if run is None else run
        new = self.register.append(t, x[:, position], boxes, BELIEF, runs)
        self.register.id[first:] = new if ids is None else ids
        self.register.next_id = max(self.register.next_id, 1 + int(self.register.id[first:].max(initial=0)))
        self.register.status[first:] = CONFIRMED
        self.t = t if self.t is None else self.t
        return self.register.id[first:].copy()

    @property
    def rates(self) -> Rates:
        """P_D and clutter density of the first station."""
        return self.stations.each[0].rates

    @property
    def road(self) -> Road | None:
        """Maps learnt from traffic; None without them."""
        return self.picture.road

    def _timing(self, rule: Associator | ForestRule, births: bool) -> Timing:
        """Immediate or deferred decisions, by the kind of rule."""
        if isinstance(rule, str | type):
            raise ConfigError(f"associate is {rule!r}; give an instance, such as GNN()")
        if not isinstance(rule, ForestRule):
            return Immediate(rule, self.sharing, self.two_stage, births)
        if isinstance(self.sharing, Occlusion):
            raise ConfigError(f"{type(rule).__name__} decides later and knows no shared blobs; leave Occlusion out")
        return Deferred(rule.forest(), self.two_stage, births)

    def _predict(self, scan: Scan, events: list[Event]) -> float:
        """Move all rows to the scan's time and delete those unseen for too long; returns the time step [s]."""
        t = scan.t
        if len(scan) and scan.sensor is None and scan.z.shape[1] != self.model.dim:
            raise ScanError(f"measurements have {scan.z.shape[1]} components but the model moves in {self.model.dim}")
        dt = self._since_last(t)
        x, cross = self.bank.x, self.bank.cross(dt) if self.smooth else None
        self.bank.predict(dt)
        self.t = t
        self.picture.rescale(self.register, x, self.bank)
        if cross is not None:
            self._remember(cross)
        lost = self.life.lost(self.register, t)
        if np.count_nonzero(lost):
            last = dict(zip(self.register.id[lost].tolist(), self.register.updated_s[lost].tolist(), strict=True))
            for track in self.timing.ended(self.register.id, lost, lost):
                events.append(Event(t, int(track), "delete", f"no evidence since {last[int(track)]:.2f} s"))
            self._keep(~lost)
        return dt

    def _remember(self, cross: Floats) -> None:
        """Keep what a smoother needs: the prediction of the tracks that were shown, and the gain back from it."""
        gain = smoothing_gain(cross, self.bank.P)
        prior_x = np.where(self.timing.shown(len(cross))[:, None], self.bank.x, np.nan)
        self.register.link(prior_x, self.bank.P, gain)

    def _since_last(self, t: float) -> float:
        dt = 0.0 if self.t is None else t - self.t
        if dt < 0:
            raise ScanError(f"{t:.6g} s is before the last scan at {self.t:.6g} s; sort the scans by time")
        return dt

    def _gate(self, scan: Scan, view: View | None, sight: Sight, since: float) -> Problem:
        """Which measurements each track may take, and how likely each is."""
        sensor = scan.sensor or POSITION
        zhat, cov = self.bank.predicted_measurement(sensor)
        detection, clutter = self.stations.expected(scan, zhat, self.register, sight, since)
        problem = Problem.gated(
            self.gate, zhat, cov, scan, detection * self.picture.in_view(self.bank.x, self.bank.P), clutter,
            run=self.register.run, label=self.register.label, angles=sensor.angles,
            modes=None if self._mixture is None else self._mixture.modes(sensor),
        )  # fmt: skip
        if self.threshold is not None:
            problem = thresholded(problem, self.threshold, zhat)
        return self.picture.weigh(problem, view)

    def _associate(self, problem: Problem, view: View | None, dt: float, events: list[Event]) -> Association:
        """Assign measurements to tracks, now or later; first those of targets that the sensor does not resolve."""
        shown = self.timing.shown(problem.rows)
        shared = self.sharing.unresolved(problem, shown, self.register, self.bank, dt)
        return self.timing.associate(problem, shared, view, self.register, events)

    def _update(
        self, found: Association, scan: Scan, view: View | None, sight: Sight, dt: float, since: float
    ) -> Outcome:
        """Update states, boxes and existence with the measurements that the tracks took.

        sight      of the rows' successors
        dt, since  seconds since the last scan, and since the last one of the same station
        """
        register = self.register
        self.bank.update(found.decision, for_update(scan, since), scan.sensor or POSITION)
        hit, sure = found.taken >= 0, self.two_stage.surely(scan, found.taken)
        self.stations.miss(scan, found, sight, register, self.bank, since)
        looked = self.stations.record(scan, register, sight, hit, sure, found.problem.detection, dt)
        if scan.label is not None:
            rows = hit.nonzero()[0]
            told = scan.label[found.taken[rows]]
            register.label[rows] = np.where(told < 0, register.label[rows], told)
        self.picture.follow(view, found.taken, register, self.bank, dt)
        self.sharing.update(found, view, register, self.bank, dt)
        return Outcome(found.measurement, self._weigh_evidence(found, looked, dt, since), self._why(found))

    def _weigh_evidence(self, found: Association, looked: Mask, dt: float, since: float) -> Floats:
        """Update the tracks' existence (Bayes' rule in log-odds) and the estimates of P_D and clutter density.

        Returns the normalised innovations squared (T,), NaN for a miss.
        """
        problem, alone = found.problem, found.shared < 0
        log_ratio, nis = evidence(problem, found.decision, found.taken)
        weighed = self.stations.evidence(
            problem.scan, log_ratio, self.register, self.bank.x, self.bank.P, self.model, since
        )
        self.register.add_evidence(weighed, alone)
        if self.stations.estimate:
            self.stations.learn(found, self.register, alone & self.timing.shown(problem.rows), looked, dt)
        self.register.seen(looked)
        return nis

    def _why(self, found: Association) -> Choices | None:
        """The choices of the tracks that are shown."""
        if not self.explain:
            return None
        why = choices(self.register.id, found.problem.pairs, found.decision, found.taken)
        return why.only(self.timing.shown(found.problem.rows))

    def _delete(self, found: Association, t: float, events: list[Event]) -> Mask:
        """Delete tracks that are hopeless, have left, or are part of another vehicle; returns (T,) the rows kept."""
        register = self.register
        left = register.history & 1 == 0
        unseen = left.nonzero()[0]
        if len(unseen):
            x, P = self.bank.x.take(unseen, axis=0), self.bank.P.take(unseen, axis=0)
            left[unseen] = self.picture.in_view(x, P) < 0.5  # likelier outside
        relieved = self.picture.relieved(register, self.bank)
        hopeless = self.life.hopeless(register)
        xy = self._xy()
        register.move(xy, t)
        register.come_in(xy, self.picture.sides(around(self.bank.x, register.box)))
        idle = self.life.idle(register, t)
        ending = hopeless | left | relieved | idle
        parts = self.sharing.parts(register, self.bank, t, ending)
        going = ending | parts
        shared = found.shared
        if np.count_nonzero(going):
            shared = shared[~going]
            for gone, why in (
                (hopeless & ~left, self.life.ends),
                (left, "left the picture"),
                (relieved & ~left & ~hopeless, "another vehicle comes in where it left"),
                (idle & ~left & ~relieved & ~hopeless, "never travelled and stands still"),
                (parts & ~ending, "part of another vehicle"),
            ):
                if np.count_nonzero(gone):
                    events.extend(Event.each(t, self.timing.ended(register.id, going, gone), "delete", why))
            self._keep(~going)
        self.sharing.merge(shared, register, t, events)
        return ~going

    def _register(self, found: Association, scan: Scan, view: View | None, dt: float, events: list[Event]) -> Ints:
        """Start tentative tracks from free measurements (B,), which are returned, and confirm those that qualify."""
        born = found.free.nonzero()[0]
        if len(born):
            born = self.sharing.newcomers(born, view, self.register, self.bank)
        if len(born):
            self._start(born, scan, events)
        self._confirm(scan.t, dt, events)
        return born

    def _start(self, born: Ints, scan: Scan, events: list[Event]) -> None:
        """Start a tentative track from each of these measurements (B,)."""
        box = np.full((len(born), 4), np.nan) if scan.box is None else scan.box[born]
        scale = longer(box) if self.model.per_size and scan.box is not None else np.ones(len(born))
        position, cov = (scan.sensor or POSITION).locate(scan.z[born], scan.R[born])
        self.bank.append(position, cov, scale)
        run = np.zeros(len(born), np.int64) if scan.run is None else scan.run[born]
        label = None if scan.label is None else scan.label[born]
        ids = None if self.number is None else self.number(scan, born)
        sides = self.picture.sides(absolute(box, position))
        ids = self.register.append(scan.t, position, box, self.life.birth, run, label, ids, sides)
        for track, j in zip(ids.tolist(), born.tolist(), strict=True):
            events.append(Event(scan.t, track, "birth", f"measurement {j} belongs to no track"))

    def _confirm(self, t: float, dt: float, events: list[Event]) -> None:
        """Confirm the tentative tracks that qualify, and set the status of all others by what was seen of them."""
        register = self.register
        self.timing.settle(register, t, events)
        if np.count_nonzero(register.status == TENTATIVE):
            travel = self.sharing.travel(register, self.bank, self.road, dt)
            ready = self.life.confirmed(register, t, travel, self.picture.size(register.box, self._xy()))
            ready = self.timing.confirm(ready, register)
            if np.count_nonzero(ready):
                events.extend(Event.each(t, register.id[ready], "confirmed", self.life.confirms))
        register.settle()

    def _tracks(self, t: float, outcome: Outcome, events: list[Event]) -> Tracks:
        """The tracks after a scan; the picture learns from them."""
        links = self.register.links() if self.smooth else {}
        more: dict[str, Any] = {"events": tuple(events), "choices": outcome.choices, **links}
        tracks = self._snapshot(t, self.bank.x, self.bank.P, outcome.measurement, outcome.nis, **more)
        self.picture.learn(tracks)
        return tracks

    def _snapshot(self, t: float, x: Floats, P: Floats, taken: Ints, nis: Floats, **more: Any) -> Tracks:
        return self.timing.visible(snapshot(self.register, self.model, t, x, P, taken, nis, **more))

    def _xy(self) -> Floats:
        """(T, d) the tracks' positions."""
        return self.bank.x.take(self.model.position, axis=1)

    def _keep(self, kept: Mask) -> None:
        self.timing.keep(kept)
        rows = kept.nonzero()[0]
        self.bank.keep(rows)
        self.register.keep(rows)
