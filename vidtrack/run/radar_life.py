"""The life of the tracks of radars."""

from __future__ import annotations

from collections.abc import Sequence

from vidtrack.config.settings import Settings
from vidtrack.radar.scans import Measurements, longest_coast
from vidtrack.tracking.lifecycle import Life
from vidtrack.tracking.methods import life
from vidtrack.tracking.station import Station

UNSEEN_S = 10.0
"""s; so long a track is kept of which misses say nothing, as of a vehicle that stands at a light."""


def radar_life(settings: Settings, feeds: Sequence[Measurements], stations: Sequence[Station]) -> Life:
    """How tracks of these radars are confirmed, and end: no later than at a pause of all.

    A miss by a station that may not see a target hardly counts, so with one the time without a plot is bounded, too:
    by radar.unseen_s, else UNSEEN_S, or so many scans of the slowest radar as end a track if that is longer.
    """
    common, radar = settings.tracker, settings.radar
    bound_s = radar.unseen_s
    if bound_s is None and any(station.may_not_see for station in stations):
        bound_s = max([UNSEEN_S, *(radar.coast_scans * found.rhythm.scan_s for found in feeds)])
    longest_s = longest_coast(feeds)
    return life(
        radar.life,
        common,
        common.confirm_hits,
        common.confirm_window,
        coast_s=longest_s if bound_s is None else min(bound_s, longest_s),
        coast_scans=radar.coast_scans,
    )
