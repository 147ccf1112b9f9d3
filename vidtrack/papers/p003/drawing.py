"""Plots and tables of figures 7 to 10: errors over time, and their histograms."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from vidtrack.arrays.types import Floats
from vidtrack.papers import style
from vidtrack.papers.p003.experiment import SCANS, SETTLED, TIMES, mean_and_se
from vidtrack.papers.p003.scenario import CHANNELS, UNITS, WAYS, Study
from vidtrack.papers.result import Row

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def time_figure(each: Study) -> Figure:
    """Upper row: errors of the first run, as in the paper; lower row: mean absolute errors of all runs."""
    drawing, panels = style.figure(len(CHANNELS), 2, panel=(4.2, 3.0))
    for c, (channel, unit) in enumerate(zip(CHANNELS, UNITS, strict=True)):
        one, every = panels[c], panels[c + len(CHANNELS)]
        for way in WAYS:
            error = each.error[way.name][..., c]
            one.plot(TIMES, error[:, 0], color=way.colour, lw=1.0, ls=way.line, alpha=1 if way.bank else 0.4)
            mean, se = mean_and_se(np.abs(error))
            every.fill_between(TIMES, mean - 1.96 * se, mean + 1.96 * se, color=way.colour, alpha=0.2, lw=0)
            every.plot(TIMES, mean, color=way.colour, lw=1.3, ls=way.line, label=way.name)
        style.title(one, f"{channel}: error of one run [{unit}]")
        style.title(every, f"{channel}: mean |error|, 95 % [{unit}]")
        every.set_ylim(bottom=0)
        every.set_xlabel("time [s]")
    handles, labels = panels[-1].get_legend_handles_labels()
    drawing.legend(handles, labels, loc="outside lower center", ncols=len(WAYS), frameon=False, fontsize=9)
    return drawing


def time_rows(each: Study, claim: str) -> list[Row]:
    """One row per channel, filter and scan."""
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
    drawing, (ax,) = style.figure(panel=(7.2, 5.2))
    for way in WAYS:
        error = each.error[way.name][SETTLED, :, channel].ravel()
        label = f"{way.name}: 95 % within ±{each.half_width(way.name, channel):.3g} {UNITS[channel]}"
        ax.hist(error, list(bins), density=True, histtype="step", color=way.colour, lw=1.5, ls=way.line, label=label)
    for label, width, colour in paper:
        ax.axvline(-width, color=colour, ls=":", lw=1.2, label=label)
        ax.axvline(width, color=colour, ls=":", lw=1.2)
    ax.set_xlim(bins[0], bins[-1])
    ax.set_xlabel(f"error of {CHANNELS[channel]} [{UNITS[channel]}]")
    ax.set_ylabel("density")
    drawing.legend(loc="outside lower center", ncols=2, frameon=False, fontsize=9)
    return drawing


def histogram_rows(each: Study, channel: int, bins: Floats, claim: str) -> list[Row]:
    """One row per filter and bin."""
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
    """One sentence with the mean absolute errors of a channel."""
    parts = [f"{each.mean_abs(way.name, channel):.3g} ({way.name})" for way in WAYS]
    return f"{CHANNELS[channel]} [{UNITS[channel]}] " + ", ".join(parts)
