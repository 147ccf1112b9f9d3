"""Tracks groups of targets in radar plots instead of single targets."""

from __future__ import annotations

from vidtrack.config.settings import Settings
from vidtrack.errors import ConfigError
from vidtrack.radar.filters import estimator, motion
from vidtrack.radar.scans import NONLINEAR, Measurements
from vidtrack.run.radar_life import radar_life
from vidtrack.scan import Scan
from vidtrack.tracking.deferred.forest import ForestRule
from vidtrack.tracking.formation.groups import Formation, GroupTracker, GroupTracks
from vidtrack.tracking.methods import gate, rule
from vidtrack.tracking.picture.picture import NoPicture
from vidtrack.tracking.rates import Rates
from vidtrack.tracking.station import Station
from vidtrack.tracks import Tracks


class Groups:
    """The groups of a run over plots: a tracker whose tracks are groups.

    last  the groups after the last scan
    """

    def __init__(self, settings: Settings, found: Measurements, rates: Rates, seed: int = 0) -> None:
        """Raises ConfigError for settings that groups do not go with."""
        radar, common = settings.radar, settings.tracker
        assert radar.group_link_m is not None
        associate = rule(common)
        if radar.estimator in NONLINEAR:
            raise ConfigError(f"groups are of positions, which {radar.estimator} has not; take kalman or imm")
        if isinstance(associate, ForestRule):
            raise ConfigError(f"groups are decided in each scan, and {common.method} decides later; take gnn or jpda")
        if radar.snr_db is not None:
            raise ConfigError("a group has no amplitude for radar.snr_db; leave one of the two out")
        if settings.output.smooth or common.redundant is not None:
            raise ConfigError("groups go without --smooth and tracker.redundant; leave these out")
        merge = radar.group_link_m if radar.group_merge_m is None else radar.group_merge_m
        stations = [Station(rates)]
        self.tracker = GroupTracker(
            Formation(radar.group_link_m, merge),
            model=motion(radar, found.dim),
            estimator=estimator(radar, found, seed),
            associate=associate,
            gate=gate(common, radar.euclidean_radius_m, adaptive=True),
            life=radar_life(settings, [found], stations),
            picture=NoPicture(),
            stations=stations,
        )
        self.last: GroupTracks | None = None

    @property
    def rates(self) -> Rates:
        """P_D and clutter density of groups."""
        return self.tracker.tracker.rates

    def step(self, scan: Scan) -> Tracks:
        """Take one scan of positions and return all groups at its time."""
        self.last = self.tracker.step(scan)
        return self.last.tracks

    def sizes(self) -> list[tuple[int, int, int]]:
        """Id, members and members seen of the groups after the last scan."""
        if self.last is None:
            return []
        tracks, size, seen = self.last
        return list(zip(tracks.id.tolist(), size.tolist(), seen.tolist(), strict=True))
