"""The tables of a report as CSV."""

from __future__ import annotations

from dataclasses import astuple
from pathlib import Path

import numpy as np

from vidtrack.output.report.page import Page
from vidtrack.output.report.spreadsheet import Cell, write_sheet
from vidtrack.traffic.validation.audit import Reviewed

SPEED_STEP = 5.0
"""km/h; width of the classes in speed_histogram.csv"""


def write_sheets(folder: Path, page: Page) -> None:
    """Write each table that there is data for. Raises StoppedEarly on a full disk."""
    found, sheet = page.found, page.sheet
    times = [found.clock.stamp(t) for t in found.edges]
    when = list(zip(times[:-1], times[1:], found.coverage.tolist(), strict=True))
    if sheet.movements:
        header = ["begin", "end", "coverage", *(one.name for one in sheet.movements), "all"]
        rows = zip(when, sheet.count.tolist(), sheet.total.tolist(), strict=True)
        write_sheet(folder / "turning_movements.csv", header, ([*w, *counts, total] for w, counts, total in rows))
        write_sheet(
            folder / "origin_destination.csv",
            ["from", "to", "turn", "trips"],
            (
                [one.start, one.end, one.turn, trips]
                for one, trips in zip(sheet.movements, sheet.sums.tolist(), strict=True)
            ),
        )
    if page.peak is not None:
        hour = [times[page.peak.first], times[page.peak.last]]
        header = ["from", "begin", "end", "vehicles", "peak_hour_factor", "factor_low", "factor_high"]
        write_sheet(folder / "peak_hour.csv", header, ([name, *hour, *numbers] for name, *numbers in page.peaks))
    if page.speeds:
        _write_speeds(folder, page)
    if page.legs:
        header = ["begin", "end", "coverage", "from", "flow_per_h", *(["queue", "queue_m"] if found.metres else [])]
        day = (
            [*w, leg.leg, leg.flow[k], *([leg.queue[k], leg.queue_m[k]] if found.metres else [])]
            for k, w in enumerate(when)
            for leg in page.legs
        )
        write_sheet(folder / "flow_and_queues.csv", header, day)
    if page.close is not None:
        header = ["kind", "conflicts", "with_ttc", "with_pet", "least_ttc_s", "least_pet_s"]
        write_sheet(folder / "conflicts.csv", header, (_known(astuple(kind)) for kind in page.close.kinds))
    write_sheet(folder / "coverage.csv", ["begin", "end", "coverage"], when)
    if found.site.gates:
        write_sheet(folder / "checks.csv", ["check", "meaning", "vehicles"], page.checks)
    if page.reviewed is not None:
        _write_reviewed(folder, page.reviewed)
    if page.paths is not None:
        _write_paths(folder, page)


def _write_reviewed(folder: Path, reviewed: Reviewed) -> None:
    header = ["gate", "counted", "looked_at", "false", "missed", "corrected"]
    header += ["sample", "precision", "precision_low", "precision_high"]
    rows = (
        (name, one.counted, one.looked_at, one.false, one.missed, one.corrected, one.sample)
        + ((None,) * 3 if one.precision is None else astuple(one.precision))
        for name, one in reviewed.rows
    )
    write_sheet(folder / "looked_at.csv", header, rows)


def _known(row: tuple[Cell, ...]) -> list[Cell]:
    """The row with empty cells for infinity."""
    return [None if cell == np.inf else cell for cell in row]


def _write_speeds(folder: Path, page: Page) -> None:
    header = ["gate", "direction", "vehicles", "mean_kmh", "v85_kmh", "v85_low_kmh", "v85_high_kmh"]
    header += ["own_sigma_kmh", "shared_sigma_kmh"]
    ways = page.speeds
    rows = (
        (one.gate, one.direction, len(one.speed), one.speed.mean(), one.v85, one.low, one.high, one.own, one.shared)
        for one in ways
    )
    write_sheet(folder / "speeds.csv", header, rows)
    edges = np.arange(0, max(float(one.speed.max()) for one in ways) + SPEED_STEP, SPEED_STEP)
    counts = [np.histogram(one.speed, edges)[0].tolist() for one in ways]
    write_sheet(
        folder / "speed_histogram.csv",
        ["from_kmh", "to_kmh", *(f"{one.gate} {one.direction}" for one in ways)],
        ([*row] for row in zip(edges[:-1].tolist(), edges[1:].tolist(), *counts, strict=True)),
    )


def _write_paths(folder: Path, page: Page) -> None:
    assert page.paths is not None
    unit, heat, ways = "m" if page.found.metres else "px", page.paths.heat, page.paths.ways
    rows, columns = np.nonzero(heat.seconds)
    cells = zip(heat.x[columns].tolist(), heat.y[rows].tolist(), heat.seconds[rows, columns].tolist(), strict=True)
    write_sheet(folder / "heat_map.csv", [f"x_{unit}", f"y_{unit}", "vehicle_seconds"], cells)
    if ways is not None and len(ways.t):
        lines = zip(ways.vehicle.tolist(), ways.t.tolist(), ways.along.tolist(), strict=True)
        write_sheet(folder / "time_space.csv", ["trip", "time_s", f"along_{unit}"], lines)
