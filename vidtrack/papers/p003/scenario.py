"""Figures 7 to 10: the three channels of a flight through Kalman and particle filters, drawn over time and as histograms."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.random import Generator

from vidtrack.estimate.bank import Estimator
from vidtrack.estimate.error_signal import ErrorSignalBank
from vidtrack.estimate.kalman import KalmanBank
from vidtrack.estimate.particle import ParticleBank
from vidtrack.papers import style
from vidtrack.papers.p003.experiment import (
    MODEL,
    PARTICLES,
    SCAN_S,
    SCANS,
    SETTLED,
    TIMES,
    estimate,
    mean_and_se,
    measure,
    polar,
)
from vidtrack.papers.result import Row
from vidtrack.scan import Floats
from vidtrack.simulate.flight import Flight
from vidtrack.simulate.radar_scenarios import MULTIFUNCTION

if TYPE_CHECKING:
    from matplotlib.figure import Figure

CHANNELS = ("range", "azimuth", "elevation")
UNITS = ("m", "deg", "deg")
INDEX = 0.02
"""Tracking index accel dt^2 / sigma of a filter for a channel that hardly accelerates."""

UNDERTUNED = 0.1
"""Share of the right acceleration that the under-tuned filter is told."""


@dataclass(frozen=True, slots=True)
class Way:
    """A filter: its bank from a seed, None for the plain measurement; the share of the channel's acceleration it knows."""

    name: str
    colour: str
    bank: Callable[[int], Estimator] | None
    knows: float = 1.0


WAYS = (
    Way("measurement", style.GREY, None),
    Way("Kalman, under-tuned", style.ORANGE, lambda seed: KalmanBank(MODEL), UNDERTUNED),
    Way("Kalman, tuned", style.BLUE, lambda seed: KalmanBank(MODEL)),
    Way("particles, bootstrap", style.GREEN, lambda seed: ParticleBank(MODEL, PARTICLES, seed=seed)),
    Way("particles, the paper's", style.RED, lambda seed: ErrorSignalBank(MODEL, PARTICLES, seed=seed)),
)


@dataclass(frozen=True, slots=True, eq=False)
class Study:
    """Errors (SCANS, runs, 3) of each way, by name, and the accelerations (3,) that the tuned filters are told."""

    error: dict[str, Floats]
    accel: Floats

    def mean_abs(self, name: str, channel: int) -> float:
        """Mean absolute error of all runs after the first three seconds."""
        return float(np.abs(self.error[name][SETTLED, :, channel]).mean())

    def half_width(self, name: str, channel: int) -> float:
        """95 % of a channel's errors after the first three seconds are below this."""
        return float(np.quantile(np.abs(self.error[name][SETTLED, :, channel]), 0.95))


def study(flight: Flight, runs: int, rng: Generator) -> Study:
    """Run all ways on the same measurements of a flight; tuned ones are told each channel's largest acceleration."""
    truth, sigma = polar(flight), np.array(MULTIFUNCTION.sigma)
    largest = np.abs(np.diff(truth, 2, axis=0)).max(axis=0) / SCAN_S**2
    accel = np.maximum(largest, INDEX * sigma / SCAN_S**2)
    seen = measure(truth, sigma, runs, rng)
    error = {}
    for way in WAYS:
        bank = way.bank and way.bank(int(rng.integers(2**32)))
        found = estimate(bank, seen, np.tile(way.knows * accel, runs)) if bank else seen.z
        error[way.name] = (found - seen.truth).reshape(SCANS, runs, len(sigma))
    return Study(error, accel)


def time_figure(each: Study) -> Figure:
    """Upper row: the errors of the first run, as the paper shows one; lower row: mean absolute errors of all runs."""
    drawing, panels = style.figure(len(CHANNELS), 2, panel=(4.2, 3.0))
    for c, (channel, unit) in enumerate(zip(CHANNELS, UNITS, strict=True)):
        one, every = panels[c], panels[c + len(CHANNELS)]
        for way in WAYS:
            error = each.error[way.name][..., c]
            look = {"color": way.colour, "lw": 0.8 if way.bank is None else 1.3}
            one.plot(TIMES, error[:, 0], **look, alpha=0.4 if way.bank is None else 1)
            mean, se = mean_and_se(np.abs(error))
            every.fill_between(TIMES, mean - 1.96 * se, mean + 1.96 * se, color=way.colour, alpha=0.2, lw=0)
            every.plot(TIMES, mean, **look, label=way.name)
        style.title(one, f"{channel}: error of one run [{unit}]")
        style.title(every, f"{channel}: mean |error|, 95 % [{unit}]")
        every.set_ylim(bottom=0)
        every.set_xlabel("time [s]")
    handles, labels = panels[-1].get_legend_handles_labels()
    drawing.legend(handles, labels, loc="outside lower center", ncols=len(WAYS), frameon=False, fontsize=9)
    return drawing


def time_rows(each: Study, claim: str) -> list[Row]:
    """One row a channel, filter and scan."""
    rows: list[Row] = []
    for c, channel in enumerate(CHANNELS):
        for way in WAYS:
            error = each.error[way.name][..., c]
            mean, se = mean_and_se(np.abs(error))
            head: Row = {"channel": channel, "filter": way.name, "accel": float(way.knows * each.accel[c])}
            rows += [
                head | {"time_s": float(TIMES[k]), "error_first_run": float(error[k, 0]),
                        "mean_abs_error": float(mean[k]), "mean_abs_error_se": float(se[k]),
                        "runs": error.shape[1], "paper_claim": claim}
                for k in range(SCANS)
            ]  # fmt: skip
    return rows


def histogram(each: Study, channel: int, bins: Floats, paper: Sequence[tuple[str, float, str]]) -> Figure:
    """Distribution of a channel's errors after three seconds; the paper's bounds as (label, half width, colour)."""
    drawing, (ax,) = style.figure(panel=(7.2, 4.4))
    for way in WAYS:
        error = each.error[way.name][SETTLED, :, channel].ravel()
        label = f"{way.name}: 95 % within ±{each.half_width(way.name, channel):.3g} {UNITS[channel]}"
        ax.hist(error, bins, density=True, histtype="step", color=way.colour, lw=1.5, label=label)
    for label, width, colour in paper:
        ax.axvline(-width, color=colour, ls=":", lw=1.2, label=label)
        ax.axvline(width, color=colour, ls=":", lw=1.2)
    ax.set_xlim(bins[0], bins[-1])
    ax.set_ylim(0, 1.45 * ax.get_ylim()[1])
    ax.set_xlabel(f"error of {CHANNELS[channel]} [{UNITS[channel]}]")
    ax.set_ylabel("density")
    style.legend(ax, ncols=2, loc="upper center")
    return drawing


def histogram_rows(each: Study, channel: int, bins: Floats, claim: str) -> list[Row]:
    """One row a filter and bin."""
    rows: list[Row] = []
    for way in WAYS:
        error = each.error[way.name][SETTLED, :, channel].ravel()
        share = np.histogram(error, bins)[0] / len(error)
        head: Row = {"filter": way.name, "mean_abs_error": each.mean_abs(way.name, channel),
                     "within_95": each.half_width(way.name, channel)}  # fmt: skip
        rows += [
            head | {"from": float(low), "to": float(high), "share": float(part),
                    "runs": each.error[way.name].shape[1], "paper_claim": claim}
            for low, high, part in zip(bins[:-1], bins[1:], share, strict=True)
        ]  # fmt: skip
    return rows


def summary(each: Study, channel: int) -> str:
    """The mean absolute errors of a channel in words."""
    parts = [f"{each.mean_abs(way.name, channel):.3g} ({way.name})" for way in WAYS]
    return f"{CHANNELS[channel]} [{UNITS[channel]}] " + ", ".join(parts)
