"""The counts of a run while its site is drawn: what `measure` finds, again and again, without reading the run again."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import reduce

import numpy as np

from vidtrack.arrays.types import Floats, Ints
from vidtrack.errors import ConfigError, FormatError, SourceError
from vidtrack.traffic.calibration.ground import Ground
from vidtrack.traffic.measures.checks import movements
from vidtrack.traffic.measures.gates import gates_of
from vidtrack.traffic.measures.journeys import journeys
from vidtrack.traffic.measures.passing import Passed, Passing, reaches
from vidtrack.traffic.measures.rows import Reader, Rows
from vidtrack.traffic.measures.runs import has_tracks, open_day
from vidtrack.traffic.measures.staying import Staying, outlines_of
from vidtrack.traffic.measures.stretches import Stretches
from vidtrack.traffic.shapes import Point
from vidtrack.traffic.site import Calibration, Fault, Gate, Site

MOST_ROWS = 4_000_000
"""Rows that stay in memory, of 100 bytes: 20,000 vehicles of 8 s at 25 frames/s."""
_MOST_CORNERS = 300_000
_FINE_PX = 3.0
"""Corners of all paths together, and least distance of two on a path: as fine as they can be seen and drawn at once."""


@dataclass(frozen=True, slots=True)
class Tally:
    """What a site's gates and zones count, as plain data.

    counts     by gate and direction, as in the table `crossings`
    stays      by zone, as in the table `stays`
    movements  from leg, to leg, whole trips, as in measures.json
    trips      all trips, whole or not
    faults     gates and zones that are not on the road; nothing is counted there
    """

    counts: dict[str, dict[str, int]]
    stays: dict[str, int]
    movements: list[tuple[str, str, int]]
    trips: int
    faults: list[Fault]


class Recount:
    """The rows of a run, which stay in memory, and what was found in them.

    runs     folders of the run: one, or the parts of a live run
    size     (width, height) px of its pictures
    until_s  of a run with more than `most` rows only the beginning is counted, to this time; None: all of it

    A live run may delete its oldest parts meanwhile: when the rows are read again, they are left out.
    Raises ConfigError, SourceError or FormatError for what cannot be used.
    """

    def __init__(self, runs: Sequence[str], most: int = MOST_ROWS) -> None:
        self._day = open_day(runs, None)
        sizes = {recording.size for recording in self._day.recordings}
        if len(sizes) > 1:
            raise ConfigError("the parts of this run have pictures of several sizes; draw over one part")
        (self.size,) = sizes
        self.until_s: float | None = None
        self._most = most
        self._load(None, None)

    def of(self, site: Site, ground: Ground | None) -> Tally:
        """The counts of a site that is drawn on pictures of this size. `ground`: its road; None: without metres."""
        self._lay_on(site, ground)
        faults = self._look_over_gates(site, ground) + self._look_into_zones(site, ground)
        gates = {name: gate for name, gate in site.gates.items() if gate.line in self._passed}
        vehicle, counts, moved, trips = np.arange(len(self._lives.track)), {}, [], 0
        if gates:
            all_gates = gates_of(site.model_copy(update={"gates": gates}), ground)
            passed, metres, allowed = self._passings(gates), ground is not None, site.movements.allowed
            found = journeys(all_gates, passed, self._lives, self._day.spans, metres, allowed)
            vehicle, trips = found.vehicle, len(found.trips.vehicle)
            passed = found.passings.passed
            ways = np.bincount(2 * passed.gate + passed.side, minlength=2 * len(gates)).reshape(-1, 2)
            counts = {
                name: dict(zip(names, way, strict=True))
                for name, names, way in zip(all_gates.names, all_gates.directions, ways.tolist(), strict=True)
            }
            moved = [(*legs, n) for legs, n in sorted(movements(found.trips, passed, all_gates).items())]
        zones = {name: self._stays.get(zone.polygon) for name, zone in site.tracked_zones.items()}
        stays = {name: len(staying.in_zones(vehicle).zone) for name, staying in zones.items() if staying is not None}
        return Tally(counts, stays, moved, trips, faults)

    def _passings(self, gates: dict[str, Gate]) -> Passed:
        """Of all gates, by their numbers."""
        first, *others = (self._passed[gate.line].at_gate(k) for k, gate in enumerate(gates.values()))
        return reduce(Passed.and_also, others, first)

    def paths(self, site: Site, ground: Ground | None) -> tuple[Ints, Floats]:
        """(T,) numbers of corners of the tracks' paths, and (N, 2) the corners of all [px]: where they are counted."""
        self._lay_on(site, ground)
        track = np.concatenate([np.empty(0, np.int64), *(rows.track for rows in self._rows)])
        xy = np.concatenate([np.empty((0, 2)), *(rows.xy for rows in self._rows)])
        if ground is not None:
            with np.errstate(invalid="ignore", divide="ignore"):
                xy = ground.pixels(xy)
        known = np.flatnonzero(np.isfinite(xy).all(axis=1))
        order = known[np.argsort(track[known], kind="stable")]
        return _thinned(track[order], xy[order])

    def _lay_on(self, site: Site, ground: Ground | None) -> None:
        """Have the rows on this road."""
        calibration = None if ground is None else site.calibration
        if calibration != self._calibration:
            self._load(calibration, ground)

    def _load(self, calibration: Calibration | None, ground: Ground | None) -> None:
        """Read the rows of the parts that are still there."""
        while True:
            try:
                self._read(calibration, ground)
            except (OSError, FormatError) as error:
                left = tuple(one for one in self._day.recordings if has_tracks(one.folder))
                if not left:
                    raise SourceError("the tracks of this run have been deleted; open a newer one") from None
                if len(left) == len(self._day.recordings):
                    if isinstance(error, FormatError):
                        raise
                    raise SourceError(f"the tracks of this run cannot be read: {error}") from None
                self._day = replace(self._day, recordings=left)
            else:
                return

    def _read(self, calibration: Calibration | None, ground: Ground | None) -> None:
        stretches, blocks = Stretches(metres=ground is not None), list[Rows]()
        for rows in Reader(self._day, {self.size: ground}):
            if sum(map(len, blocks)) >= self._most:
                self.until_s = float(blocks[-1].t[-1])
                break
            blocks.append(stretches.add(rows))
        self._lives = stretches.lives()
        self._calibration, self._rows = calibration, blocks
        self._passed: dict[tuple[Point, ...], Passed] = {}
        self._stays: dict[tuple[Point, ...], Staying] = {}

    def _look_over_gates(self, site: Site, ground: Ground | None) -> list[Fault]:
        """Find who passes the gates that were not there before, and forget those that are gone."""
        before, self._passed, faults = self._passed, {}, []
        for name, gate in site.gates.items():
            if gate.line not in before:
                try:
                    alone = gates_of(site.model_copy(update={"gates": {name: gate}}), ground)
                    passing = Passing(alone, *reaches(ground is not None))
                except ConfigError as error:
                    faults.append(Fault(("gates", name), str(error)))
                    continue
                for rows in self._rows:
                    passing.add(rows)
                before[gate.line] = passing.passed()
            self._passed[gate.line] = before[gate.line]
        return faults

    def _look_into_zones(self, site: Site, ground: Ground | None) -> list[Fault]:
        before, self._stays, faults = self._stays, {}, []
        for name, zone in site.tracked_zones.items():
            if zone.polygon not in before:
                try:
                    outline = outlines_of(site.model_copy(update={"zones": {name: zone}}), ground)
                except ConfigError as error:
                    faults.append(Fault(("zones", name), str(error)))
                    continue
                before[zone.polygon] = Staying(outline, metres=ground is not None)
                for rows in self._rows:
                    before[zone.polygon].add(rows)
            self._stays[zone.polygon] = before[zone.polygon]
        return faults


def _thinned(track: Ints, xy: Floats) -> tuple[Ints, Floats]:
    """Paths with a corner every few pixels, and their two ends; `track` (N,) is sorted."""
    if len(track) == 0:
        return np.empty(0, np.int64), xy
    new = np.diff(track, prepend=track[0] - 1) != 0
    step = np.where(new, 0.0, np.hypot(*np.diff(xy, axis=0, prepend=xy[:1]).T))
    way = np.cumsum(step)
    spacing = max(_FINE_PX, way[-1] / _MOST_CORNERS)
    kept = new | np.roll(new, -1) | (np.diff(way // spacing, prepend=0) != 0)
    return np.bincount(np.cumsum(new[kept]) - 1), xy[kept]
