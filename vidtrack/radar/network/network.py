"""The plots of several radars as scans of one tracker, in order of time, without the biases known so far."""

from __future__ import annotations

import heapq
import logging
from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

from vidtrack.arrays.types import Floats, Ints
from vidtrack.config.radar import RadarSettings
from vidtrack.errors import ConfigError
from vidtrack.radar.coordinates import wrap
from vidtrack.radar.feeds.plots import Code
from vidtrack.radar.feeds.recording import is_feed, senders
from vidtrack.radar.network.copies import Measured, copies
from vidtrack.radar.network.coverage import Sector, too_slow
from vidtrack.radar.network.radars import Placed, Radars
from vidtrack.radar.network.registration import KINDS, Plotted, Registration
from vidtrack.radar.network.untold import with_untold
from vidtrack.radar.plots import Plots
from vidtrack.radar.reading import read_any
from vidtrack.radar.scans import Measurements, Span, measurements, spans
from vidtrack.scan import Scan
from vidtrack.tracking.blind import BlindZone
from vidtrack.tracks import TENTATIVE, Tracks

_log = logging.getLogger(__name__)

BIAS_M, BIAS_SHARE = 30.0, 0.005
"""m; standard deviation of the unknown bias of a range, and the share of the radar's range that it is at most."""
CLOCK_S = 1.0
"""s; standard deviation of the error of a clock that is expected to have none, by which one is found."""
SURE = 3.3
"""Standard deviations of the estimate beyond which a clock is off."""
FARTHEST_S = 3 * CLOCK_S
"""s; errors of a clock beyond this come out too small, and are not estimated."""
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
    def span_s(self) -> tuple[float, float]:
        """The times of the first and last plot."""
        return float(self.plots.time_s.min()), float(self.plots.time_s.max())

    @property
    def coast_s(self) -> float:
        """How long a track coasts, by the time of a scan."""
        return self.settings.coast_scans * self.scan_s


@dataclass(frozen=True, slots=True)
class Turn:
    """A scan of one of several radars: `station` is the number of its feed, `span` its rows there."""

    station: int
    span: Span


class Network:
    """The scans of several feeds in order of time, and the registration of their radars.

    `scan` makes the scan of a turn, without the biases that are known by then; `learn` learns from what the tracker
    made of it, and `stated` has in the tracks' errors what is not known of the biases.

    A second registration allows an error to each clock that is expected to have none; once it is sure that one is off,
    it takes over.
    """

    def __init__(self, feeds: Sequence[Feed]) -> None:
        self.feeds = tuple(feeds)
        sigma = np.array([feed.bias_sigma for feed in feeds])
        sigma[0, 2] = 0.0  # common to all clocks nothing can be told
        if len(feeds) == 1:
            sigma[:] = 0.0
        self._told_s = -np.inf
        self._R = np.array([np.diag(np.median(feed.plots.sigma[:, :2], axis=0) ** 2) for feed in feeds])
        self.registration = self._registration(sigma)
        unexpected = sigma[:, :2].any(axis=1) & (sigma[:, 2] == 0)
        unexpected[0] = False
        sigma[unexpected, 2] = CLOCK_S
        self._unexpected, self._with_clocks = np.flatnonzero(unexpected), self._registration(sigma)

    def _registration(self, sigma: Floats) -> Registration:
        """A registration of all radars with these standard deviations of their biases (S, 3)."""
        settings = self.feeds[0].settings
        return Registration(
            [feed.placed.xyz[:2] for feed in self.feeds], sigma, np.array([feed.scan_s for feed in self.feeds]),
            jerk=2 * settings.accel**2 * settings.hold_s,
        )  # fmt: skip

    def __iter__(self) -> Iterator[Turn]:
        """The scans of all feeds in order of their stated times."""
        lists = (
            [Turn(station, span) for span in spans(feed.plots.scan, feed.plots.time_s)]
            for station, feed in enumerate(self.feeds)
        )
        return heapq.merge(*lists, key=lambda turn: turn.span.t)

    @property
    def count(self) -> int:
        """Number of scans of all feeds."""
        return sum(feed.found.count for feed in self.feeds)

    def scan(self, turn: Turn) -> Scan:
        """The scan of a turn without the known biases; what is not known of them is in its covariances."""
        feed = self.feeds[turn.station]
        noise = feed.found.R.mean(axis=0)
        bias, cov = self.registration.of(turn.station)
        if not cov.any():
            return feed.found.scan_of(turn.span, noise, station=turn.station)
        plots = _unbiased(feed.plots.rows(turn.span.rows), bias, cov, feed.settings.max_speed / 2)
        own = turn.span._replace(rows=slice(0, len(plots)))
        return measurements(plots, feed.settings).scan_of(own, noise, bias[KINDS - 1], turn.station)

    def stated(self, tracks: Tracks) -> Tracks:
        """The tracks with what is not known of the biases in their covariances."""
        if not len(tracks) or not self.registration.cov.any():
            return tracks
        return with_untold(tracks, self.registration, [feed.coverage.share(tracks.xy) for feed in self.feeds], self._R)

    def learn(self, turn: Turn, tracks: Tracks) -> None:
        """Learn the biases from the plots that confirmed tracks took in this scan, unless it has told them already."""
        if turn.span.t <= self._told_s:
            return
        took = np.flatnonzero((tracks.status != TENTATIVE) & (tracks.measurement >= 0) & (tracks.group < 0))
        feed = self.feeds[turn.station]
        plots = feed.plots.rows(turn.span.rows).of_extended_targets(feed.settings.extent_m)
        rows = tracks.measurement[took]
        R = np.einsum("ni,ij->nij", plots.sigma[rows, :2] ** 2, np.eye(2))
        taken = Plotted(
            turn.station, tracks.id[took], plots.time_s[rows], plots.z[rows, :2], R, tracks.xy[took], tracks.v[took]
        )
        self.registration.learn(turn.span.t, taken)
        if len(self._unexpected) and self.registration is not self._with_clocks:
            self._with_clocks.learn(turn.span.t, taken)
            off = self._off()
            if len(off) and (np.abs(self._with_clocks.bias[off, 2]) < FARTHEST_S).all():
                self.registration = self._with_clocks

    def _off(self) -> Ints:
        """The radars whose clocks are off, though no error of them is expected."""
        off_s, sigma_s = self._with_clocks.bias[:, 2], self._with_clocks.sigma()[:, 2]
        return self._unexpected[np.abs(off_s[self._unexpected]) > SURE * sigma_s[self._unexpected]]

    def learnt_until(self, t: float) -> None:
        """The scans up to t come once more: they have told what they can of the biases."""
        self._told_s = t
        self.registration.begin_anew()
        self._with_clocks.begin_anew()

    def warn_of_biases(self) -> None:
        """A warning says so if by the end fewer common targets were compared than there are biases to tell.

        Another one names each radar whose clock is off, though no error of it is expected.
        """
        if self.registration.used < np.count_nonzero(self.registration.prior):
            _log.warning(
                "hardly any target of two radars told their biases: were there none at one time, or are the places and "
                "directions of %s wrong?", _radars(self.feeds),
            )  # fmt: skip
        off_s, sigma_s = self._with_clocks.bias[:, 2], self._with_clocks.sigma()[:, 2]
        for k in self._off().tolist():
            _log.warning(
                "the clock of %s seems to be %s%.2f s %s that of %s (+- %.2f s), which radars.toml does not expect%s: "
                "give the radar bias_time_s there", self.feeds[k].placed.name,
                "more than " if abs(off_s[k]) > FARTHEST_S else "", abs(off_s[k]),
                "ahead of" if off_s[k] > 0 else "behind", self.feeds[0].placed.name, sigma_s[k],
                ", and is estimated since it was sure" if self.registration is self._with_clocks else "",
            )  # fmt: skip

    def as_dict(self) -> dict[str, dict[str, float | bool]]:
        """The biases of each radar by name, with their standard deviations, and whether the targets have told them."""
        if len(self.feeds) == 1:
            return {self.feeds[0].placed.name: {}}  # nothing to compare with
        estimate, sigma, observed = self.registration.bias, self.registration.sigma(), self.registration.observed()
        found: dict[str, dict[str, float | bool]] = {}
        for k, feed in enumerate(self.feeds):
            found[feed.placed.name] = own = {}
            for j, (name, unit) in enumerate((("range", "m"), ("azimuth", "deg"), ("time", "s"))):
                factor = 180 / np.pi if unit == "deg" else 1.0
                own[f"bias_{name}_{unit}"] = round(float(estimate[k, j] * factor), 5)
                own[f"bias_{name}_sigma_{unit}"] = round(float(sigma[k, j] * factor), 5)
                own[f"bias_{name}_observed"] = bool(observed[k, j])
        return found


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
    names = [feed.placed.name for feed in feeds]
    for name in names:
        if names.count(name) > 1:
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
            "right?", _radars(alone), times,
        )  # fmt: skip
        return
    alone = _alone(feeds, _at_one_place, shown)
    if alone:
        _log.warning(
            "%s with no place in common with another radar: none has plots where the other one detects targets, so "
            "their errors can hardly be compared: are their places and directions right?", _radars(alone),
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


def _radars(feeds: Sequence[Feed]) -> str:
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
    return Measured(plots.time_s, plots.z[:, 0], azimuth, np.median(plots.sigma[:, :2], axis=0), feed.scan_s)


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


def _unbiased(plots: Plots, bias: Floats, cov: Floats, speed: float) -> Plots:
    """Plots (N,) without a bias (3,), with what is not known of it, cov (3, 3), in their errors.

    speed  standard deviation of a velocity [m/s]: so much an unknown time is worth
    """
    z, sigma = plots.z.copy(), plots.sigma.copy()
    z[:, :2] -= bias[:2]
    z[:, 0] = np.maximum(z[:, 0], 0.0)
    z[:, 1] = wrap(z[:, 1])
    late = cov[2, 2] * speed**2
    sigma[:, 0] = np.sqrt(sigma[:, 0] ** 2 + cov[0, 0] + late)
    sigma[:, 1] = np.sqrt(sigma[:, 1] ** 2 + cov[1, 1] + late / np.maximum(z[:, 0] ** 2 + late, 1.0))  # at most 1 rad
    return replace(plots, z=z, sigma=sigma)
