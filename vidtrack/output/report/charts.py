"""Charts of a report: counts, speeds, flow and queues over the day, coverage, ways over time."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.patches import Rectangle

from vidtrack.arrays.types import Floats
from vidtrack.output.report.style import (
    BLUE,
    GREY,
    INK,
    PALE,
    SIGNAL,
    WIDTH,
    drawing,
    not_watched,
    png,
    time_axis,
    whole_numbers,
)
from vidtrack.traffic.clock import Clock
from vidtrack.traffic.report.legs import LegDay
from vidtrack.traffic.report.paths import Ways
from vidtrack.traffic.report.sheet import WATCHED, PeakHour, Sheet
from vidtrack.traffic.report.speeds import Speeds

WAYS_DRAWN = 6
"""Most histograms of speeds; the others are in the table."""
_NUMBERED = 100
"""Most intervals, a day of 15 minutes, whose counts are written as numbers"""


def movements(sheet: Sheet, peak: PeakHour | None, clock: Clock) -> bytes:
    """Counts by interval and movement, darker for more; the peak hour framed, hatched where nobody watched.

    Intervals that were watched in part have their share beside them.
    """
    intervals, columns = sheet.count.shape
    with drawing(1.2 + 0.15 * min(max(intervals, 4), _NUMBERED)) as (figure, (axes,)):
        (axis,) = axes
        axis.imshow(np.ma.masked_invalid(sheet.count), cmap="Blues", vmin=0, aspect="auto", interpolation="nearest")
        for k in np.flatnonzero(sheet.coverage <= 0).tolist():
            place = (-0.5, k - 0.5)
            axis.add_patch(Rectangle(place, columns, 1, facecolor="none", edgecolor=GREY, hatch="/////", linewidth=0))
        if intervals <= _NUMBERED:
            half = np.nanmax(sheet.count, initial=1) / 2
            for k, m in np.argwhere(np.isfinite(sheet.count)).tolist():
                count = sheet.count[k, m]
                colour = "white" if count > half else INK
                axis.text(m, k, f"{count:.0f}", ha="center", va="center", fontsize=6.5, color=colour, in_layout=False)
        if peak is not None:
            place = (-0.5, peak.first - 0.5)
            axis.add_patch(
                Rectangle(place, columns, peak.last - peak.first, fill=False, edgecolor=SIGNAL, linewidth=1.6)
            )
        step = -(-intervals // _NUMBERED)
        begins = zip(sheet.edges[:-1].tolist(), sheet.coverage.tolist(), strict=True)
        times = [clock.label(t) + (f" ({share:.0%})" if 0 < share < WATCHED else "") for t, share in begins]
        axis.set_yticks(range(0, intervals, step), times[::step], fontsize=6.5)
        names = [f"{one.start} {one.turn}\nto {one.end}" for one in sheet.movements]
        axis.set_xticks(range(columns), names, rotation=90, fontsize=6.5)
        axis.xaxis.tick_top()
        axis.tick_params(length=0)
        return png(figure)


def speed_histograms(ways: Sequence[Speeds]) -> bytes:
    """Speeds at each gate, with the 85th percentile and its bounds where the vehicles are enough for bounds."""
    shown = ways[:WAYS_DRAWN]
    columns = min(2, len(shown))
    rows = -(-len(shown) // columns)
    top = max(float(np.quantile(one.speed, 0.995)) for one in shown)
    step = 5.0 if top < 150 else 10.0
    bins = np.arange(0, max(top, 30.0) + step, step)
    with drawing(0.4 + 1.5 * rows, rows, columns, shared=True) as (figure, axes):
        for axis, one in zip(axes.flat, shown, strict=False):
            axis.hist(np.clip(one.speed, 0, bins[-1]), bins, color=PALE, edgecolor=BLUE, linewidth=0.6)
            title = f"{one.gate}, {one.direction}: {len(one.speed)} vehicle{'s' * (len(one.speed) != 1)}"
            if np.isfinite(one.low):
                axis.axvline(one.v85, color=SIGNAL, linewidth=1.4)
                axis.axvspan(one.low, one.high, color=SIGNAL, alpha=0.2, linewidth=0)
                title += f", v85 {one.v85:.0f} km/h"
            axis.set_title(title, fontsize=7)
            whole_numbers(axis)
        for axis in axes.flat[len(shown) :]:
            axis.set_axis_off()
        figure.supxlabel("km/h")
        figure.supylabel("vehicles")
        return png(figure)


def over_the_day(
    legs: Sequence[LegDay], values: Sequence[Floats], what: str, clock: Clock, edges: Floats, coverage: Floats
) -> bytes:
    """One row of bars for each leg; pale where an interval was watched in part, hatched where nobody watched."""
    colour = np.where(coverage < WATCHED, PALE, BLUE)
    with drawing(0.5 + 0.95 * len(legs), len(legs), shared=True) as (figure, axes):
        for axis, leg, height in zip(axes.flat, legs, values, strict=True):
            known = np.isfinite(height)
            bars = edges[:-1][known], height[known], np.diff(edges)[known]
            axis.bar(*bars, align="edge", color=colour[known], linewidth=0)
            not_watched(axis, edges, coverage)
            axis.set_title(f"from {leg.leg}")
        top = max((float(np.nanmax(height, initial=0)) for height in values), default=0)
        axes[0, 0].set_ylim(0, 1.05 * top or 1)
        whole_numbers(axes[0, 0])
        time_axis(axes[-1, 0], clock, edges)
        figure.supylabel(what)
        return png(figure)


def coverage_strip(clock: Clock, edges: Floats, coverage: Floats) -> bytes:
    """Share of each interval that was watched."""
    with drawing(1.4) as (figure, axes):
        axis = axes[0, 0]
        axis.bar(edges[:-1], 100 * coverage, np.diff(edges), align="edge", color=BLUE, edgecolor="white", linewidth=0.3)
        not_watched(axis, edges, coverage)
        axis.set_ylim(0, 100)
        axis.set_yticks([0, 50, 100])
        axis.set_ylabel("watched, %")
        time_axis(axis, clock, edges)
        return png(figure)


def time_space(ways: Ways, clock: Clock, unit: str) -> bytes:
    """Distance over time of each vehicle; the gates as lines."""
    with drawing(0.62 * WIDTH) as (figure, axes):
        axis = axes[0, 0]
        breaks = np.flatnonzero(np.diff(ways.vehicle)) + 1
        for t, along in zip(np.split(ways.t, breaks), np.split(ways.along, breaks), strict=True):
            axis.plot(t, along, color=BLUE, linewidth=0.9)
        for gate, name in ((0.0, f"entry, {ways.movement.start}"), (ways.length, f"exit, {ways.movement.end}")):
            axis.axhline(gate, color=SIGNAL, linewidth=0.9, linestyle="--")
            axis.annotate(
                name, (1, gate), xycoords=("axes fraction", "data"), xytext=(0, 2), textcoords="offset points",
                ha="right", va="bottom", fontsize=7, color=SIGNAL,
            )  # fmt: skip
        axis.set_ylim(-0.3 * ways.length, 1.3 * ways.length)
        axis.set_ylabel(f"along the way, {unit}")
        time_axis(axis, clock, np.array([ways.begin_s, ways.end_s]))
        return png(figure)
