"""From finished runs at a site to its traffic figures."""

from __future__ import annotations

import json
import logging
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from itertools import islice
from typing import Any

import numpy as np
import pyarrow as pa

from vidtrack.arrays.types import Floats, Ints
from vidtrack.errors import ConfigError
from vidtrack.traffic.calibration.account import examined
from vidtrack.traffic.calibration.ground import Ground
from vidtrack.traffic.calibration.sections import section_doubts
from vidtrack.traffic.measures.ahead import compile_ahead
from vidtrack.traffic.measures.approaches import approaches
from vidtrack.traffic.measures.by_traffic import by_stretches, contradicting
from vidtrack.traffic.measures.checks import balance, movements
from vidtrack.traffic.measures.conflicts import KINDS, PET, TTC, Meeting
from vidtrack.traffic.measures.crossings import REASONS, following, section_speeds, way_names
from vidtrack.traffic.measures.gates import Gates, gates_of
from vidtrack.traffic.measures.intervals import coverage, edges_of, figure_columns, figures
from vidtrack.traffic.measures.journeys import journeys
from vidtrack.traffic.measures.passing import Passed, Passing, reaches
from vidtrack.traffic.measures.queues import queues_of
from vidtrack.traffic.measures.rows import Reader
from vidtrack.traffic.measures.runs import Day, open_day
from vidtrack.traffic.measures.staying import Staying, outlines_of
from vidtrack.traffic.measures.stretches import Lives, Stretches
from vidtrack.traffic.measures.tables import stamps, table, words
from vidtrack.traffic.measures.trip_speeds import TripSpeeds, trip_speeds
from vidtrack.traffic.site import Site
from vidtrack.traffic.vehicles.naming import whole_tracks
from vidtrack.traffic.vehicles.vehicles import Vehicles

_log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class Measures:
    """The tables by name, and in plain data what was watched and what the checks say."""

    tables: dict[str, pa.Table]
    report: dict[str, Any]


def measured(runs: Sequence[str], site: Site, *, blocks: int | None = None) -> Measures:
    """The figures of all runs together, each FOLDER or FOLDER@TIME as `open_day` has it.

    blocks  of rows, `blocks.BLOCK` each, that are looked at; None: all

    Raises ConfigError, SourceError or FormatError for what cannot be used.
    """
    day = open_day(runs, site.camera.start)
    if blocks is None:
        compile_ahead(runs, site, day)
    sizes = sorted({recording.size for recording in day.recordings})
    if len(sizes) > 1 and site.calibration is None:
        raise ConfigError("the runs have pictures of several sizes; give the site a calibration, or measure each alone")
    drawn = {size: site.scaled(*size) for size in sizes}
    accounts = {size: examined(one) for size, one in drawn.items() if one.calibration is not None}
    grounds = {size: accounts[size].ground if size in accounts else None for size in sizes}
    against = accounts[sizes[0]].against if accounts else []
    if accounts and not against:
        for line in accounts[sizes[0]].report["warnings"]:
            _log.warning("%s", line)
    gates = gates_of(drawn[sizes[0]], grounds[sizes[0]])
    outlines = outlines_of(drawn[sizes[0]], grounds[sizes[0]])
    metres, ground = site.calibration is not None, grounds[sizes[0]]
    reader, stretches, passing = Reader(day, grounds), Stretches(metres), Passing(gates, *reaches(metres))
    staying, meeting, vehicles = Staying(outlines, metres), Meeting(), Vehicles(ground)
    with ThreadPoolExecutor(1) as beside:
        met = beside.submit(lambda: None)
        for rows in by_stretches(islice(reader, blocks), stretches, vehicles):
            passing.add(rows)
            staying.add(rows)
            met.result()
            met = beside.submit(meeting.add, rows)  # takes as long as all else, and so has a thread of its own
        met.result()
    lives = stretches.lives()
    passed, ways = passing.passed(), passing.ways(len(lives.track))
    del stretches, passing  # which are large
    pa.default_memory_pool().release_unused()  # what the tables were read into
    return _Figures(
        day, site, drawn[sizes[0]], gates, ground, against, reader, passed, ways, lives, staying, meeting, vehicles
    ).measures()


def beginning(told: str) -> None:
    """Measure the first rows of runs at a site, both in JSON as `compile_ahead` tells them."""
    runs, site = json.loads(told)
    measured(runs, Site.model_validate(site), blocks=1)


class _Figures:
    """All figures of a day, from what is left of its tracks."""

    def __init__(
        self,
        day: Day,
        site: Site,
        drawn: Site,
        gates: Gates,
        ground: Ground | None,
        against: list[str],
        reader: Reader,
        passed: Passed,
        ways: Floats,
        lives: Lives,
        staying: Staying,
        meeting: Meeting,
        vehicles: Vehicles,
    ) -> None:
        self.day, self.site, self.drawn, self.gates, self.ground = day, site, drawn, gates, ground
        self.staying, self.meeting = staying, meeting
        self.lives, self.ways = lives, ways
        self.metres = ground is not None
        self.spans = day.spans
        sessions, track_ids = reader.names
        self.tracks = len(track_ids)
        self.session, self.track_id = sessions[lives.track], track_ids[lives.track]
        driven = journeys(gates, passed, lives, self.spans, self.metres, site.movements.allowed)
        known = driven.passings
        self.passed, self.probability, self.reason = known.passed, known.probability, known.reason
        self.joins, self.vehicle, self.trips = driven.joins, driven.vehicle, driven.trips
        found = vehicles.fitted(self.vehicle, self.passed.track, self.passed.t)
        self.against = {"calibration": against, **contradicting(found)}
        if found is not None:
            self.passed = self.passed.with_speeds(found.speeds.speed, found.speeds.own, found.speeds.shared)
        classes = site.classes if self.metres else {}
        whole = whole_tracks(None if found is None else found.classes, lives.length, lives.length_sigma, classes)
        self.length, self.kind, self.kind_probability = whole.length, whole.kind, whole.probability
        if not self.metres:
            self.passed = self.passed.with_speeds(*section_speeds(self.passed, self._sections()))
        zone = site.camera.start
        self.edges = edges_of(self.spans, site.report.interval_s, day.utc, None if zone is None else zone.tzinfo)
        self.watched = coverage(self.spans, self.edges)

    def measures(self) -> Measures:
        """The tables and the report."""
        moved = movements(self.trips, self.passed, self.gates)
        allowed = self.site.movements.allowed
        impossible = {pair: count for pair, count in moved.items() if allowed and pair not in allowed}
        tables = {
            "crossings": self._crossings(),
            "trips": self._trips(allowed),
            "intervals": self._intervals(),
            "stays": self._stays(),
            "queues": self._queues(),
            "checks": self._checks(),
        }
        if self.ground is not None:
            tables["conflicts"] = self._conflicts(self.ground)
        report = {
            "site": self.site.camera.name,
            "metres": self.metres,
            "runs": [
                {
                    "folder": str(one.folder),
                    "begin_s": round(one.begin_s, 3),
                    "end_s": round(one.end_s, 3),
                    "run": one.session,
                }
                for one in self.day.recordings
            ],
            "utc_of_time_0": None if self.day.utc is None else self.day.utc.isoformat(),
            "watched_s": round(float(np.diff(self.spans).sum()), 3),
            "tracks": self.tracks,
            "crossings": len(self.passed),
            "trips": len(self.trips.vehicle),
            "complete_trips": int(self.trips.complete.sum()),
            "joins": len(self.joins.before),
            "conflicts": len(tables["conflicts"]) if self.metres else None,
            "movements": [{"from": a, "to": b, "trips": count} for (a, b), count in sorted(moved.items())],
            "impossible_movements": [
                {"from": a, "to": b, "trips": count} for (a, b), count in sorted(impossible.items())
            ],
            **self.against,
            "sections": [] if self.ground is None else section_doubts(self.drawn, self.ground),
            "appeared": int(self.trips.appeared.sum()),
            "vanished": int(self.trips.vanished.sum()),
        }
        return Measures(tables, report)

    def _sections(self) -> list[tuple[int, int, float]]:
        names = self.gates.names
        sections = self.site.sections.values()
        return [(names.index(one.from_gate), names.index(one.to_gate), one.length_m) for one in sections]

    def _crossings(self) -> pa.Table:
        passed, metres = self.passed, self.metres
        length = self.length[passed.track]
        after = following(passed, length, self.spans, metres)
        gate, direction = way_names(self.gates, passed)
        return table(
            {
                "time_s": ("s", passed.t),
                "utc": ("utc", stamps(self.day.utc, passed.t)),
                "gate": ("", gate),
                "direction": ("", direction),
                "run": ("n", self.session[passed.track]),
                "track_id": ("n", self.track_id[passed.track]),
                **self._class_of(passed.track),
                "length_m": ("m", length),
                "speed_kmh": ("km/h", 3.6 * passed.speed),
                "speed_sigma_kmh": ("km/h", 3.6 * passed.speed_sigma),
                "speed_shared_sigma_kmh": ("km/h", 3.6 * passed.speed_shared),
                "gap_s": ("s", after.gap),
                "headway_s": ("s", after.headway),
                ("along_m" if metres else "along_px"): ("m" if metres else "px", passed.along),
                "confidence": ("1", self.probability),
                "reason": ("", [REASONS[why] for why in self.reason.tolist()]),
            }
        )

    def _trips(self, allowed: tuple[tuple[str, str], ...]) -> pa.Table:
        trips, gates, passed = self.trips, self.gates, self.passed
        gate = np.append(passed.gate, len(gates))  # the last one: of no passing
        names, legs = [*gates.names, None], [*gates.legs, None]
        entry, exit_ = gate[trips.entry].tolist(), gate[trips.exit].tolist()
        from_leg, to_leg = [legs[g] for g in entry], [legs[g] for g in exit_]
        complete = trips.complete.tolist()
        possible = [
            (pair in allowed) if whole and allowed else None
            for whole, pair in zip(complete, zip(from_leg, to_leg, strict=True), strict=True)
        ]
        whole_tracks = np.unique(np.column_stack([self.vehicle, self.session, self.track_id]), axis=0)[:, 0]
        count = np.bincount(whole_tracks, minlength=len(self.vehicle))[trips.vehicle]
        length, pace = self.length[trips.vehicle], self._trip_speeds()
        return table(
            {
                "run": ("n", self.session[trips.vehicle]),
                "track_id": ("n", self.track_id[trips.vehicle]),
                **self._class_of(trips.vehicle),
                "length_m": ("m", length),
                "entry_gate": ("", [names[g] for g in entry]),
                "exit_gate": ("", [names[g] for g in exit_]),
                "from_leg": ("", from_leg),
                "to_leg": ("", to_leg),
                "begin_s": ("s", trips.from_s),
                "end_s": ("s", trips.to_s),
                "begin_utc": ("utc", stamps(self.day.utc, trips.from_s)),
                "end_utc": ("utc", stamps(self.day.utc, trips.to_s)),
                "mean_speed_kmh": ("km/h", 3.6 * pace.speed),
                "mean_speed_sigma_kmh": ("km/h", 3.6 * pace.own),
                "mean_speed_shared_sigma_kmh": ("km/h", 3.6 * pace.shared),
                "complete": ("yes", complete),
                "possible": ("yes", possible),
                "reason": ("", trips.reasons()),
                "tracks": ("n", count),
                "join_confidence": ("1", self.joins.likely(self.vehicle)[trips.vehicle]),
            }
        )

    def _trip_speeds(self) -> TripSpeeds:
        if self.metres:
            return trip_speeds(self.trips, self.passed, self.gates, self.lives, self.vehicle, self.ways)
        unknown = np.full(len(self.trips.vehicle), np.nan)
        return TripSpeeds(unknown, unknown, unknown)

    def _intervals(self) -> pa.Table:
        gates, bins = self.gates, len(self.watched)
        ways = 2 * len(gates)
        length = self.length[self.passed.track]
        found = figures(self.passed, self.probability, length, self.edges, self.watched, ways)
        gate = [name for name in gates.names for _ in range(2 * bins)]
        direction = [way for pair in gates.directions for way in pair for _ in range(bins)]
        return table(
            {
                "gate": ("", gate),
                "direction": ("", direction),
                **self._when(ways),
                **figure_columns(found),
            }
        )

    def _stays(self) -> pa.Table:
        stays, names = self.staying.in_zones(self.vehicle), list(self.site.tracked_zones)
        return table(
            {
                "zone": ("", [names[zone] for zone in stays.zone.tolist()]),
                "run": ("n", self.session[stays.vehicle]),
                "track_id": ("n", self.track_id[stays.vehicle]),
                **self._class_of(stays.vehicle),
                "begin_s": ("s", stays.begin),
                "end_s": ("s", stays.end),
                "begin_utc": ("utc", stamps(self.day.utc, stays.begin)),
                "end_utc": ("utc", stamps(self.day.utc, stays.end)),
                "stay_s": ("s", stays.end - stays.begin),
                "standing_s": ("s", stays.stood),
                "came": ("yes", stays.came),
                "left": ("yes", stays.left),
            }
        )

    def _queues(self) -> pa.Table:
        standing, legs = self.staying.standing(self.vehicle), self.site.legs
        gate = approaches(standing, self.gates, self.passed, self.trips, self.lives)
        leg = np.array([*map(legs.index, self.gates.legs), -1])[gate]
        found = queues_of(standing, leg, self.length[standing.vehicle])
        return table(
            {
                "leg": ("", [legs[k] for k in found.leg.tolist()]),
                "begin_s": ("s", found.begin),
                "end_s": ("s", found.end),
                "begin_utc": ("utc", stamps(self.day.utc, found.begin)),
                "end_utc": ("utc", stamps(self.day.utc, found.end)),
                "vehicles": ("n", found.vehicles),
                "length_m": ("m", found.length),
            }
        )

    def _conflicts(self, ground: Ground) -> pa.Table:
        found = self.meeting.conflicts(self.vehicle, self.spans)
        columns: dict[str, tuple[str, Any]] = {
            "time_s": ("s", found.t),
            "utc": ("utc", stamps(self.day.utc, found.t)),
            "kind": ("", words(KINDS, found.kind)),
            "angle_deg": ("deg", np.degrees(found.angle)),
            "run": ("n", self.session[found.second]),
        }
        for name, who, speed in zip(("first", "second"), (found.first, found.second), found.speed.T, strict=True):
            columns |= {
                f"{name}_track_id": ("n", self.track_id[who]),
                f"{name}_class": ("", words(self.kind, who)),
                f"{name}_speed_kmh": ("km/h", 3.6 * speed),
            }
        for name, kind in (("ttc", TTC), ("pet", PET)):
            (x, y), (x_px, y_px) = found.xy[kind].T, ground.pixels(found.xy[kind]).T
            columns |= {
                f"{name}_s": ("s", found.value[kind]),
                f"{name}_sigma_s": ("s", found.sigma[kind]),
                f"{name}_time_s": ("s", found.when[kind]),
                **{f"{name}_x_m": ("m", x), f"{name}_y_m": ("m", y)},
                **{f"{name}_x_px": ("px", x_px), f"{name}_y_px": ("px", y_px)},
            }
        return table(columns | {"reason": ("", words(("seen", "merged"), found.merged.astype(int)))})

    def _checks(self) -> pa.Table:
        found = balance(self.trips, self.edges, self.watched * bool(self.gates))  # without gates nothing is known
        return table(
            {
                **self._when(1),
                "inflow": ("n", found.inflow),
                "outflow": ("n", found.outflow),
                "stored": ("n", found.stored),
                "left_over": ("n", found.left_over),
                "appeared": ("n", found.appeared),
                "vanished": ("n", found.vanished),
            }
        )

    def _class_of(self, track: Ints) -> dict[str, tuple[str, Any]]:
        """The classes of tracks, and how sure they are."""
        return {
            "class": ("", words(self.kind, track)),
            "class_probability": ("1", self.kind_probability[track]),
        }

    def _when(self, times: int) -> dict[str, tuple[str, Any]]:
        """Begin, end and coverage of the intervals, all of them so many times."""
        begin, end = np.tile(self.edges[:-1], times), np.tile(self.edges[1:], times)
        return {
            "begin_s": ("s", begin),
            "end_s": ("s", end),
            "begin_utc": ("utc", stamps(self.day.utc, begin)),
            "end_utc": ("utc", stamps(self.day.utc, end)),
            "coverage": ("1", np.tile(self.watched, times)),
        }
