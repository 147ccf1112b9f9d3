"""The plots of each of several radars, read from their files and placed on the common plane."""

from __future__ import annotations

import logging
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

from vidtrack.arrays.types import Floats
from vidtrack.config.radar import RadarSettings
from vidtrack.errors import ConfigError
from vidtrack.radar.coordinates import wrap
from vidtrack.radar.feeds.plots import Code
from vidtrack.radar.feeds.recording import is_feed, senders
from vidtrack.radar.network.copies import Measured, copies
from vidtrack.radar.network.coverage import Sector, too_slow
from vidtrack.radar.network.radars import Placed, Radars
from vidtrack.radar.plots import Plots
from vidtrack.radar.reading import read_any
from vidtrack.radar.scans import Measurements, measurements
from vidtrack.tracking.blind import BlindZone

_log = logging.getLogger(__name__)

BIAS_M, BIAS_SHARE = 30.0, 0.005
"""m; standard deviation of the unknown bias of a range, and the share of the radar's range that it is at most."""
SAME_TIME_S = 0.01
"""s; delays of a copy that are shorter are not told."""
_OWN = ("sigma_range_m", "sigma_azimuth_deg", "sigma_doppler_m_s", "scan_s", "sac", "sic")
"""Settings that a radar's table may have; else those of the run hold."""


@dataclass(frozen=True, slots=True)
class Feed:
    """The plots of one radar, on the common plane.

    placed    the radar and its place
    plots     azimuths are from the common north
    settings  those of the run, with the radar's own place and errors
    found     the plots as measurements, without registration
    scan_s    time of a scan
    """

    placed: Placed
    plots: Plots
    settings: RadarSettings
    found: Measurements
    scan_s: float

    @property
    def coverage(self) -> Sector:
        """What the radar covers, by its table; without a range in it, up to its farthest plot."""
        radar = self.placed.radar
        farthest = float(self.plots.z[:, 0].max()) if radar.farthest_m is None else radar.farthest_m
        return Sector(self.placed.xyz[:2], farthest, self.placed.turned, np.radians(radar.sector_deg))

    @property
    def blind(self) -> BlindZone | None:
        """The range rates at which the radar sees no target."""
        return too_slow(self.placed.xyz[:2], self.placed.radar.slowest_m_s)

    @property
    def bias_sigma(self) -> tuple[float, float, float]:
        """Standard deviations of the unknown biases in range [m], azimuth [rad] and time [s]."""
        radar = self.placed.radar
        in_range = (
            min(BIAS_M, BIAS_SHARE * self.coverage.farthest) if radar.bias_range_m is None else radar.bias_range_m
        )
        return in_range, float(np.radians(radar.bias_azimuth_deg)), radar.bias_time_s

    @property
    def xy(self) -> Floats:
        """(N, 2) m; where the plots are, on the common plane."""
        return self.found.sensor.locate(self.found.z, self.found.R)[0][:, :2]

    @property
    def sigma(self) -> Floats:
        """(2,) usual standard deviations of ranges [m] and azimuths [rad]."""
        return np.asarray(np.median(self.plots.sigma[:, :2], axis=0))

    @property
    def span_s(self) -> tuple[float, float]:
        """The times of the first and last plot."""
        return float(self.plots.time_s.min()), float(self.plots.time_s.max())

    @property
    def coast_s(self) -> float:
        """How long a track coasts, by the time of a scan."""
        return self.settings.coast_scans * self.scan_s


def read_feeds(paths: Sequence[str], radars: Radars, settings: RadarSettings) -> list[Feed]:
    """The feeds of tables and recordings: the file NAME.csv, NAME.ast, ... has the plots of the radar NAME.

    A recording of ASTERIX with another name is of all the radars whose sac and sic are in it.
    Raises SourceError, PlotFormatError, and ConfigError for a stream, a file of no radar, or two of one, for two radars
    with the same plots, and for radar.scan_s if it is for none of these.
    """
    for path in paths:
        if "://" in path:
            raise ConfigError(f"{path} is a stream; here plots are read from tables and recordings")
    feeds = [feed for path in paths for feed in _feeds(Path(path), radars, settings)]
    _refuse_idle(feeds, radars, settings)
    own = [feed.placed.name for feed in feeds]
    for name in own:
        if own.count(name) > 1:
            raise ConfigError(f"two files have plots of radar {name!r}; put them into one")
    if len(feeds) > 1 and any(not feed.plots.polar for feed in feeds):
        cartesian = next(feed.placed.name for feed in feeds if not feed.plots.polar)
        raise ConfigError(f"the plots of radar {cartesian!r} have x and y; several radars need range_m and azimuth_deg")
    _refuse_same(feeds)
    return feeds


def warn_if_apart(feeds: Sequence[Feed], shown: Collection[int] = ()) -> None:
    """A warning names the radars that have no time, or no place, in common with another one.

    shown  numbers of those that have plots where a camera shows the road: it may join them
    """
    if len(feeds) < 2:
        return
    alone = _alone(feeds, _at_one_time)
    if alone:
        times = "; ".join("{} has {:.10g} to {:.10g} s".format(one.placed.name, *one.span_s) for one in feeds)
        _log.warning(
            "%s with no time in common with another radar (%s), so their errors can hardly be compared: are the clocks "
            "right?", names(alone), times,
        )  # fmt: skip
        return
    alone = _alone(feeds, _at_one_place, shown)
    if alone:
        _log.warning(
            "%s with no place in common with another radar: none has plots where the other one detects targets, so "
            "their errors can hardly be compared: are their places and directions right?", names(alone),
        )  # fmt: skip


def _alone(feeds: Sequence[Feed], meet: Callable[[Feed, Feed], bool], joined: Collection[int] = ()) -> list[Feed]:
    """The feeds that meet no other and are not among the numbers of joined ones."""
    met = [(one, other) for one, other in combinations(range(len(feeds)), 2) if meet(feeds[one], feeds[other])]
    return [feed for k, feed in enumerate(feeds) if k not in joined and not any(k in pair for pair in met)]


def overlap(one: tuple[float, float], other: tuple[float, float], within_s: float) -> bool:
    """Whether two spans of time, from begin to end [s], overlap, or are at most so far apart."""
    return one[0] - other[1] <= within_s and other[0] - one[1] <= within_s


def _at_one_time(one: Feed, other: Feed) -> bool:
    """Whether the times of two radars overlap, or are as near as a track coasts."""
    return overlap(one.span_s, other.span_s, max(one.coast_s, other.coast_s))


def _at_one_place(one: Feed, other: Feed) -> bool:
    """Whether one of two radars has plots in the other's coverage, or as near its plots as a track coasts."""
    if any((b.coverage.share(a.xy) > 0).any() for a, b in ((one, other), (other, one))):
        return True
    farthest_m = max(feed.settings.max_speed * feed.coast_s for feed in (one, other))
    apart_m, _ = cKDTree(one.xy).query(other.xy, distance_upper_bound=farthest_m)
    return bool(np.isfinite(apart_m).any())


def names(feeds: Sequence[Feed]) -> str:
    """The names of radars in a message."""
    names = ", ".join(repr(feed.placed.name) for feed in feeds)
    return f"radar{'s' if len(feeds) > 1 else ''} {names}"


def _refuse_same(feeds: Sequence[Feed]) -> None:
    """Raise ConfigError if most plots of a feed are another's: echoes of one radar would confirm its false plots."""
    measured = [_as_measured(feed) for feed in feeds]
    for (one, own), (other, others) in combinations(zip(feeds, measured, strict=True), 2):
        found = copies(own, others)
        if found.of_one_radar:
            raise ConfigError(
                f"radars {one.placed.name!r} and {other.placed.name!r} have the same plots ({found.same} of "
                f"{found.fewer}{_how_late(found.later_s)}) to a tenth of their errors, so they are one radar; leave "
                "one of them out"
            )


def _how_late(later_s: float) -> str:
    """The delay of the second feed's plots in words, if it is one."""
    return f", {abs(later_s):.3g} s {'later' if later_s > 0 else 'earlier'}" if abs(later_s) >= SAME_TIME_S else ""


def _as_measured(feed: Feed) -> Measured:
    plots = feed.plots
    azimuth = plots.z[:, 1] - feed.placed.turned
    return Measured(plots.time_s, plots.z[:, 0], azimuth, feed.sigma, feed.scan_s)


def _refuse_idle(feeds: Sequence[Feed], radars: Radars, settings: RadarSettings) -> None:
    """Raise ConfigError for radar.scan_s if there is no recording of a radar whose table does not say it."""
    recorded = [feed.placed.radar for feed in feeds if feed.plots.losses]
    if settings.scan_s is not None and all(radar.scan_s is not None for radar in recorded):
        raise ConfigError(
            "setting radar.scan_s has no effect here: it is for recordings of radars that have no scan_s in "
            f"{radars.path}; leave it out"
        )


def _feeds(path: Path, radars: Radars, settings: RadarSettings) -> list[Feed]:
    """The feeds of one file; its damaged records are counted with the first."""
    codes = senders(path, radars.codes) if path.stem not in radars.names and is_feed(path) else []
    placed = [radars.coded(*code) for code in codes] or [radars.named(path.stem)]
    first, *others = (_read(path, one, settings, radars.codes) for one in placed)
    return [first, *(replace(feed, plots=_without_damaged(feed.plots)) for feed in others)]


def _without_damaged(plots: Plots) -> Plots:
    return replace(plots, bad_rows=0, losses={**plots.losses, "damaged": 0})


def _read(path: Path, placed: Placed, settings: RadarSettings, codes: Collection[Code]) -> Feed:
    radar = placed.radar
    known = {name: getattr(radar, name) for name in _OWN}
    own = {name: value for name, value in known.items() if value is not None}
    settings = settings.model_copy(update={"position": placed.xyz, **own})
    plots = _level(read_any(path, settings, codes), path)
    if plots.plane is not None and not plots.polar:
        raise ConfigError(
            f"{path} has positions; a radar of --radars needs ranges and azimuths (CAT 048, CAT 001, TTM)"
        )
    if plots.polar:
        plots.z[:, 1] = wrap(plots.z[:, 1] + placed.turned)
    found = measurements(plots, settings)
    return Feed(placed, plots, settings, found, radar.scan_s or max(found.rhythm.scan_s, 1e-3))


def _level(plots: Plots, path: Path) -> Plots:
    """The plots in the plane: with an elevation, the range along the ground."""
    if plots.dim == 2 or not plots.polar:
        return plots
    _log.warning("%s has elevations: ranges become distances along the ground, and tracks are in the plane", path)
    keep = [0, 1, *range(3, plots.z.shape[1])]
    z, sigma = plots.z[:, keep], plots.sigma[:, keep]
    r, elevation = plots.z[:, 0], plots.z[:, 2]
    z[:, 0] = r * np.cos(elevation)
    sigma[:, 0] = np.hypot(sigma[:, 0] * np.cos(elevation), r * np.sin(elevation) * plots.sigma[:, 2])
    return replace(plots, z=z, sigma=sigma, dim=2)
