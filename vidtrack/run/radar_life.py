"""The life of the tracks of radars."""

from __future__ import annotations

from collections.abc import Sequence

from vidtrack.config.settings import Settings
from vidtrack.radar.scans import Measurements, longest_coast
from vidtrack.tracking.lifecycle import Life
from vidtrack.tracking.methods import life


def radar_life(settings: Settings, feeds: Sequence[Measurements]) -> Life:
    """How tracks of these radars are confirmed, and end: no later than at a pause of all."""
    common = settings.tracker
    return life(
        settings.radar.life,
        common,
        common.confirm_hits,
        common.confirm_window,
        coast_s=longest_coast(feeds),
        coast_scans=settings.radar.coast_scans,
    )
