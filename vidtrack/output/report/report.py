"""The folder of a report: report.html with everything in it, and the same as PNG and CSV."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from vidtrack.errors import Error
from vidtrack.output.folder import replacing
from vidtrack.output.report import charts, pictures
from vidtrack.output.report.page import Page, rendered
from vidtrack.output.report.sheets import write_sheets
from vidtrack.traffic.report.findings import Findings
from vidtrack.traffic.report.legs import legs_of
from vidtrack.traffic.report.paths import Paths, paths_of
from vidtrack.traffic.report.sheet import WATCHED, Sheet, intervals_of_an_hour, peak_hour, sheet_of
from vidtrack.traffic.report.speeds import speeds_of
from vidtrack.traffic.report.turns import drawn, turns
from vidtrack.video.frame import Image


@dataclass
class _Pictures:
    """PNG files by name, and in words why others are missing."""

    drawn: dict[str, bytes] = field(default_factory=dict)
    missing: dict[str, str] = field(default_factory=dict)


def write_report(folder: Path, found: Findings, scene: Image | None) -> None:
    """Write report.html, NAME.png and NAME.csv of all that the tables allow.

    scene  (H, W, 3) of the empty or any picture of the site, for the arrows; None: arrows on white

    Raises ConfigError for a site that cannot be drawn, StoppedEarly on a full disk.
    """
    sheet = sheet_of(found, turns(drawn(found.site)))
    peak = peak_hour(sheet.total, found.coverage >= WATCHED, found.edges)
    legs, speeds = legs_of(found), speeds_of(found)
    made = _Pictures()
    paths = _paths(found, sheet, made)
    clock, edges, coverage = found.clock, found.edges, found.coverage
    if sheet.movements:
        made.drawn["turning_movements"] = charts.movements(sheet, peak, clock)
        made.drawn["origin_destination"] = pictures.origins(found.site, sheet, scene)
    else:
        made.missing["turning_movements"] = "there is no whole trip from an entry gate to an exit gate"
        made.missing["origin_destination"] = made.missing["turning_movements"]
    if speeds:
        made.drawn["speeds"] = charts.speed_histograms(speeds)
    else:
        made.missing["speeds"] = "no speed was measured: without a calibration only sections with a length give speeds"
    if legs:
        made.drawn["flow"] = charts.over_the_day(legs, [leg.flow for leg in legs], "vehicles/h", clock, edges, coverage)
    else:
        made.missing["flow"] = "no vehicle passed an entry gate"
    if legs and found.metres:
        made.drawn["queues"] = charts.over_the_day(
            legs, [leg.queue for leg in legs], "longest queue, vehicles", clock, edges, coverage
        )
    else:
        made.missing["queues"] = made.missing.get("flow", "without a calibration nobody knows whether a vehicle stands")
    made.drawn["coverage"] = charts.coverage_strip(clock, edges, coverage)
    if paths is not None:
        made.drawn["heat_map"] = pictures.heat_map(paths.heat, paths.gates, found.metres)
    if paths is not None and paths.ways is not None and len(paths.ways.t):
        made.drawn["time_space"] = charts.time_space(paths.ways, clock, "m" if found.metres else "px")
    else:
        made.missing.setdefault("time_space", "there is no whole trip whose track is in the runs")
    page = Page(found, sheet, peak, _why_no_peak(found), legs, speeds, paths, scene is not None)
    for name, content in made.drawn.items():
        with replacing(folder / f"{name}.png") as new:
            new.write_bytes(content)
    write_sheets(folder, page)
    with replacing(folder / "report.html") as new:
        new.write_text(rendered(page, made.drawn, made.missing), encoding="utf-8")


def _why_no_peak(found: Findings) -> str:
    whole = intervals_of_an_hour(found.edges)
    if whole is None:
        return "an hour is not a whole number of intervals"
    watched = np.append(np.append(0, found.coverage >= WATCHED), 0)
    longest = int(np.diff(np.flatnonzero(watched == 0)).max()) - 1
    return "no vehicle was counted" if longest >= whole else "no hour of whole intervals was watched"


def _paths(found: Findings, sheet: Sheet, made: _Pictures) -> Paths | None:
    try:
        return paths_of(found, sheet)
    except Error as error:  # the runs may be gone: the rest of the report does not need them
        made.missing["heat_map"] = made.missing["time_space"] = str(error)
        return None
