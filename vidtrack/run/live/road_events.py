"""What vehicles do at a site while it is watched: they enter zones, and with a calibration come into conflict."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from vidtrack.output.linefile import Every
from vidtrack.output.sink import Step
from vidtrack.run.sinks import Subject
from vidtrack.traffic.measures.conflicts import PET, TTC, Conflicts, Meeting
from vidtrack.traffic.measures.rows import Rows
from vidtrack.traffic.measures.staying import outlines_of
from vidtrack.traffic.metres import SITE_COPY
from vidtrack.traffic.site import parse_site
from vidtrack.traffic.zone_entries import Entry, ZoneEntries

_LOOK_S = 2.0  # between two looks for conflicts


class RoadEvents:
    """Zone entries and conflicts of a subject with a site, of confirmed tracks.

    gap_s   all tracks end in a longer pause between pictures
    metres  whether the site is calibrated

    Raises ConfigError for a zone that is not on the road.
    """

    def __init__(self, subject: Subject, gap_s: float) -> None:
        assert subject.site is not None
        height, width = subject.shape
        site = parse_site(subject.site, Path(SITE_COPY)).scaled(width, height)
        self._ground = None if subject.road is None else subject.road.ground
        self._zones = ZoneEntries(dict(zip(site.tracked_zones, outlines_of(site, self._ground), strict=True)))
        self._gap_s = gap_s
        self._meeting = Meeting()
        self._unseen: list[Rows] = []
        self._last_s: float | None = None
        self._due = Every(_LOOK_S)

    @property
    def metres(self) -> bool:
        """Whether the site is calibrated."""
        return self._ground is not None

    def entries(self, steps: Sequence[Step], seen: Rows | None) -> list[Entry]:
        """The zone entries of these steps; `seen`: their tracks on the road."""
        if self._ground is None:
            found = [self._zones.step(step.time_s, step.tracks.id, step.tracks.xy) for step in steps]
            return [entry for of_step in found for entry in of_step]
        if seen is None or not len(seen):
            return []
        first = np.flatnonzero(np.diff(seen.t, prepend=-np.inf))
        found = [
            self._zones.step(float(seen.t[low]), seen.track[low:high], seen.xy[low:high])
            for low, high in zip(first, [*first[1:], len(seen)], strict=True)
        ]
        return [entry for of_moment in found for entry in of_moment]

    def conflicts(self, steps: Sequence[Step], seen: Rows | None) -> Iterator[tuple[float, dict[str, Any]]]:
        """Time [s] and content of each conflict that is over; `seen`: the tracks of these steps on the road."""
        if self._ground is None or not steps:
            return
        if self._last_s is not None and steps[0].time_s - self._last_s > self._gap_s:
            yield from self.unfinished()  # nobody knows what happened meanwhile
        self._last_s = steps[-1].time_s
        if seen is not None and len(seen):
            self._unseen.append(seen)
        if self._due():
            yield from self._over(self._last_s)

    def unfinished(self) -> Iterator[tuple[float, dict[str, Any]]]:
        """The same of those that are not over, since nobody looks on."""
        if self._ground is not None:
            yield from self._over(np.inf)
            self._meeting = Meeting()

    def _over(self, until_s: float) -> Iterator[tuple[float, dict[str, Any]]]:
        if self._unseen:
            self._meeting.add(Rows.together(self._unseen))
            self._unseen = []
        return _told(self._meeting.settled(until_s))


def prepare() -> None:
    """Compile what looks for conflicts, which on the first use takes longer than results can wait."""
    time_s = np.repeat(np.arange(0.0, 2.0, 0.1), 2)
    track = np.tile([0, 1], len(time_s) // 2)
    v = np.where(track[:, None] == 0, [10.0, 0.0], [0.0, 10.0])
    xy = (time_s[:, None] - 1.0) * v
    yes, one = np.ones(len(track), bool), np.ones(len(track))
    sides, spread = (4 * one, one / 4, 2 * one), np.tile([0.01, 0.01, 0.0], (len(track), 1))
    meeting = Meeting()
    meeting.add(
        Rows(
            track,
            time_s,
            yes,
            ~yes,
            ~yes,
            xy,
            one,
            one,
            v,
            10 * one,
            one / 9,
            one / 9,
            *sides,
            v / 10,
            spread,
            *2 * [np.full((len(track), 4), np.nan)],
        )
    )
    meeting.settled(np.inf)


def _told(found: Conflicts) -> Iterator[tuple[float, dict[str, Any]]]:
    for row, kind in enumerate(found.kinds):
        yield (
            float(found.t[row]),
            {
                "conflict": kind,
                "first_track_id": int(found.first[row]),
                "second_track_id": int(found.second[row]),
                "first_speed_kmh": 3.6 * float(found.speed[row, 0]),
                "second_speed_kmh": 3.6 * float(found.speed[row, 1]),
                "angle_deg": float(np.degrees(found.angle[row])),
                **{
                    f"{name}_{part}s": float(values[which, row])
                    for name, which in (("ttc", TTC), ("pet", PET))
                    for part, values in (("", found.value), ("sigma_", found.sigma))
                },
                "merged": bool(found.merged[row]),
            },
        )
