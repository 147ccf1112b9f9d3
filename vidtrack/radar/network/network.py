"""The plots of several radars as scans of one tracker, in order of time, without the biases known so far."""

from __future__ import annotations

import heapq
import logging
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from vidtrack.arrays.types import Floats
from vidtrack.radar.coordinates import wrap
from vidtrack.radar.network.feed import Feed, names
from vidtrack.radar.network.registration import KINDS, Plotted, Registration
from vidtrack.radar.network.untold import with_untold
from vidtrack.radar.plots import Plots
from vidtrack.radar.scans import Span, measurements, spans
from vidtrack.scan import Scan
from vidtrack.tracks import TENTATIVE, Tracks

_log = logging.getLogger(__name__)

CLOCK_S = 1.0
"""s; standard deviation of the error of a clock that is expected to have none, by which one is found."""
SURE = 3.3
"""Standard deviations of the estimate beyond which a clock is off."""
NAMED = 2.0
"""Standard deviations beyond which such a clock is named at the end."""
FARTHEST_S = 3 * CLOCK_S
"""s; errors of a clock beyond this come out too small."""


@dataclass(frozen=True, slots=True)
class Turn:
    """A scan of one of several radars: `station` is the number of its feed, `span` its rows there."""

    station: int
    span: Span


class Network:
    """The scans of several feeds in order of time, and the registration of their radars.

    `scan` makes the scan of a turn, without the biases that are known by then; `learn` learns from what the tracker
    made of it, and `stated` has in the tracks' errors what is not known of the biases.

    A second registration allows an error to each clock that is expected to have none. Once it is sure that one is off,
    it is `registration`, until comparisons contradict it: biases that are learnt without the clock are wrong.
    """

    def __init__(self, feeds: Sequence[Feed]) -> None:
        self.feeds = tuple(feeds)
        sigma = np.array([feed.bias_sigma for feed in feeds])
        sigma[0, 2] = 0.0  # common to all clocks nothing can be told
        if len(feeds) == 1:
            sigma[:] = 0.0
        self._told_s = -np.inf
        self._coverages = [feed.coverage for feed in feeds]
        self._R = np.array([np.diag(feed.sigma**2) for feed in feeds])
        self.registration = self._expected = self._registration(sigma)
        unexpected = sigma[:, :2].any(axis=1) & (sigma[:, 2] == 0)
        unexpected[0] = False
        sigma[unexpected, 2] = CLOCK_S
        self._unexpected, self._with_clocks = unexpected, self._registration(sigma)
        self._off = np.zeros(len(feeds), bool)  # of which it has been sure

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
        covered = [coverage.share(tracks.xy) for coverage in self._coverages]
        return with_untold(tracks, self.registration, covered, self._R)

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
        self._expected.learn(turn.span.t, taken)
        if self._unexpected.any():
            self._with_clocks.learn(turn.span.t, taken)
            self._judge_clocks()

    def _judge_clocks(self) -> None:
        """Decide which registration holds."""
        off_s, sigma_s = np.abs(self._with_clocks.bias[:, 2]), self._with_clocks.sigma()[:, 2]
        self._off |= self._unexpected & (off_s > SURE * sigma_s)
        self._off &= self._with_clocks.told
        self.registration = self._with_clocks if self._off.any() else self._expected

    def learnt_until(self, t: float) -> None:
        """The scans up to t come once more: they have told what they can of the biases."""
        self._told_s = t
        self._expected.begin_anew()
        self._with_clocks.begin_anew()

    def warn_of_biases(self) -> None:
        """A warning says so if by the end fewer common targets were compared than there are biases to tell.

        Another one names each radar whose clock is off, though no error of it is expected.
        """
        if not self.registration.told:
            _log.warning(
                "hardly any target of two radars told their biases: were there none at one time, or are the places and "
                "directions of %s wrong?", names(self.feeds),
            )  # fmt: skip
        off_s, sigma_s = self._with_clocks.bias[:, 2], self._with_clocks.sigma()[:, 2]
        for k in np.flatnonzero(self._off & (np.abs(off_s) > NAMED * sigma_s)).tolist():
            _log.warning(
                "the clock of %s seems to be %s%.2f s %s that of %s (+- %.2f s), which radars.toml does not expect; it "
                "has been estimated since it was sure: give the radar bias_time_s there", self.feeds[k].placed.name,
                "more than " if abs(off_s[k]) > FARTHEST_S else "", abs(off_s[k]),
                "ahead of" if off_s[k] > 0 else "behind", self.feeds[0].placed.name, sigma_s[k],
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
