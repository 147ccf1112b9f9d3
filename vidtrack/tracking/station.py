"""Stations: the sensors of a tracker, each with how well it detects, how much clutter it has, and what it sees."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from math import isnan
from typing import NamedTuple, Protocol

import numpy as np

from vidtrack.arrays.types import Floats, Ints, Mask
from vidtrack.errors import ConfigError, ScanError
from vidtrack.estimate.bank import Estimator
from vidtrack.estimate.motion.model import Motion
from vidtrack.scan import Scan
from vidtrack.tracking.association import Association
from vidtrack.tracking.blind import BlindZone
from vidtrack.tracking.rates import Rates
from vidtrack.tracking.register import BELIEF, Register
from vidtrack.tracks import MERGED, TENTATIVE


class Coverage(Protocol):
    """Where a station can detect a target."""

    def share(self, xy: Floats) -> Floats:
        """(T,) share of the detection probability at positions (T, d): from 0, nothing is seen, to 1."""


class Sight(NamedTuple):
    """What a station can see of the rows before they are updated.

    covered  (T,) share of P_D by the coverage of their places
    hidden   (T,) share of that which is lost, because the station does not detect them as they move
    """

    covered: Floats
    hidden: Floats

    @property
    def share(self) -> Floats:
        """(T,) share of P_D that is left."""
        return self.covered * (1 - self.hidden)

    def of(self, rows: Ints) -> Sight:
        """The sight of these rows (K,), which may repeat."""
        return Sight(self.covered[rows], self.hidden[rows])


@dataclass(frozen=True, slots=True)
class Visibility:
    """Targets that a station cannot see for a while: behind others, in the dark, too slow for Doppler.

    A target is visible or hidden; a hidden one is never detected. D. Musicki, R. Evans, S. Stankovic, "Integrated
    probabilistic data association", IEEE Trans. Automatic Control 39(6), 1994: Markov chain two.

    visible_s, hidden_s  s; mean time that each lasts
    """

    visible_s: float
    hidden_s: float

    @property
    def usual(self) -> float:
        """Probability that a target is visible, before anything is known of it."""
        return self.visible_s / (self.visible_s + self.hidden_s)

    def predicted(self, visible: Floats, dt: float) -> Floats:
        """(T,) probability after dt seconds."""
        stay = np.exp(-dt * (1 / self.visible_s + 1 / self.hidden_s))
        return np.asarray(self.usual + (visible - self.usual) * stay)


@dataclass(frozen=True, slots=True)
class Station:
    """One of the sensors of a tracker. A scan names its station; the measurement model is the scan's own.

    rates       detection probability of a visible target, and clutter density; given or estimated
    coverage    a target outside is neither seen nor missed; None: there is no outside
    visibility  None: targets inside are always visible
    lasting_s   s; what looks like a target goes on to do so for this time: scans within it are together the evidence of
                one. 0: each scan counts
    lasting_m   m or px; the same for travel: of a tentative track, scans within this distance are together the evidence
                of one, with `lasting_s` only. 0: its travel does not count
    blind       what it does not detect inside; a miss then tells how a target may move. None: nothing
    """

    rates: Rates = field(default_factory=Rates)
    coverage: Coverage | None = None
    visibility: Visibility | None = None
    lasting_s: float = 0.0
    lasting_m: float = 0.0
    blind: BlindZone | None = None

    STATE = ("rates",)

    def __post_init__(self) -> None:
        """Raises ConfigError."""
        if not (self.lasting_s >= 0 and self.lasting_m >= 0):
            raise ConfigError(f"lasting_s and lasting_m are 0 or more, not {self.lasting_s:g} and {self.lasting_m:g}")
        if self.lasting_m > 0 and self.lasting_s == 0:
            raise ConfigError("lasting_m has no effect without lasting_s")

    @property
    def may_not_see(self) -> bool:
        """Whether it may not see a target inside its coverage for long, so that misses say little."""
        return self.visibility is not None or self.blind is not None


class Stations:
    """The stations of a tracker by number, and when each made its last scan.

    last_s    (S,) s; NaN before the first
    estimate  whether the rates of any of them are estimated
    unseeing  whether any of them may not see a target inside its coverage
    """

    STATE = ("last_s", "each")

    def __init__(self, each: Sequence[Station]) -> None:
        self.each = tuple(each)
        self.last_s = np.full(len(self.each), np.nan)
        self.estimate = any(station.rates.estimated for station in self.each)
        self.unseeing = any(station.may_not_see for station in self.each)

    def __len__(self) -> int:
        return len(self.each)

    def evidence(
        self, scan: Scan, log_ratio: Floats, register: Register, x: Floats, P: Floats, model: Motion, since: float
    ) -> Floats:
        """(T,) evidence of a scan for the rows of a register, from their log-likelihood ratios (T,).

        x (T, n), P (T, n, n) states of a model; since: seconds after the station's last scan. A track travels with the
        speed that it has beyond the error of its speed. A ratio is limited to what is believed at all: a share of an
        infinite one would be infinite, too.
        """
        station = self.each[scan.station]
        if station.lasting_s == 0:
            return log_ratio
        weight = np.full(len(log_ratio), min(1.0, since / station.lasting_s))
        new = (register.status == TENTATIVE).nonzero()[0]
        if station.lasting_m > 0 and len(new):
            v, variance = x[new][:, model.velocity], P[new][:, model.velocity, model.velocity]
            speed = np.sqrt(np.maximum((v**2 - variance).sum(axis=1), 0.0))
            weight[new] = np.minimum(weight[new], speed * since / station.lasting_m)
        return np.asarray(np.clip(log_ratio, -BELIEF, BELIEF) * weight)

    def sight(self, scan: Scan, bank: Estimator) -> Sight:
        """What the scan's station can see of the predicted rows of a bank."""
        station, covered = self.each[scan.station], np.ones(len(bank))
        if station.coverage is not None:
            covered = station.coverage.share(bank.x.take(bank.model.position, axis=1))
        return Sight(covered, np.zeros(len(bank)) if station.blind is None else station.blind.hidden(bank))

    def take(self, scan: Scan) -> float:
        """Seconds since the last scan of the same station; 0 for the first. Raises ScanError for an unknown station."""
        if not 0 <= scan.station < len(self.each):
            raise ScanError(f"the scan is of station {scan.station}, but the tracker has {len(self.each)}, from 0")
        before = float(self.last_s[scan.station])
        self.last_s[scan.station] = scan.t
        return 0.0 if isnan(before) else scan.t - before

    def expected(
        self, scan: Scan, zhat: Floats, register: Register, sight: Sight, since: float
    ) -> tuple[float | Floats, float | Floats]:
        """P_D of the rows of which the station has this sight, and its clutter density there.

        zhat (T, m) predicted measurements; since: seconds after the station's last scan
        """
        station, number = self.each[scan.station], scan.station
        station.rates.look(scan)
        detection, clutter = station.rates.of(register.run, zhat)
        if station.visibility is not None:
            known = register.visible[:, number]
            before = np.where(np.isnan(known), station.visibility.usual, known)
            register.visible[:, number] = station.visibility.predicted(before, since)
            detection = detection * register.visible[:, number]
        return detection * sight.share, clutter

    def miss(
        self, scan: Scan, found: Association, sight: Sight, register: Register, bank: Estimator, since: float
    ) -> None:
        """Update the rows of a bank that the scan rather did not show by what that tells of them.

        sight: of the successors of the predicted rows; since: seconds after the station's last scan
        """
        station = self.each[scan.station]
        if station.blind is None:
            return
        visible = 1.0 if station.visibility is None else register.visible[:, scan.station]
        detection = station.rates.detection(register.run) * sight.covered * visible
        missed = np.where(found.shared < 0, found.decision.beta0, 0.0)
        station.blind.update(bank, scan.t, missed, detection, since)

    def record(
        self, scan: Scan, register: Register, sight: Sight, hit: Mask, sure: Mask, detection: Floats, dt: float
    ) -> Mask:
        """Note which rows (T,) of which the station has this sight the scan shows, of an expected P_D (T,).

        Returns those that it looked at: it showed them, or was rather to see them than not. Whether a target is
        visible or hidden counts for confirmed rows only.
        """
        number = scan.station
        looked = hit | (sight.share >= 0.5)
        if self.each[number].visibility is not None:
            known = register.visible[:, number].copy()
            missed = np.maximum(known - detection, 0.0) / np.maximum(1 - detection, 1e-9)
            register.visible[:, number] = np.where(hit, 1.0, np.where(looked, missed, known))
            looked &= hit | (sight.share * known >= 0.5) | (register.status == TENTATIVE)
        register.record_hits(hit, sure, looked, number, scan.t, dt)
        return looked

    def learn(self, found: Association, register: Register, alone: Mask, looked: Mask, dt: float) -> None:
        """Learn P_D and clutter density from rows (K,) that share no measurement, dt seconds after the last scan."""
        problem = found.problem
        seen, known = looked & (register.history & 1 == 1), alone & (register.status != TENTATIVE)
        count = known & seen & (register.status != MERGED)
        for number, station in enumerate(self.each):
            if not station.rates.estimated:
                continue
            now = number == problem.scan.station
            station.rates.forget(dt)
            if now:
                runs = 1 + int(register.run.max(initial=0))
                station.rates.learn_clutter(found.decision, found.shared, known, register.existence, problem.scan, runs)
            missed = register.missed[count, number] - now  # this scan is counted, and was none
            station.rates.learn_detection(missed, problem.inside[count], seen=now)
