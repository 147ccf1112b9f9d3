"""The folder of a report: report.html with everything in it, and the same as PNG and CSV."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from vidtrack.errors import Error
from vidtrack.output.folder import replacing
from vidtrack.output.report import charts, pictures
from vidtrack.output.report.page import Page, rendered
from vidtrack.output.report.sheets import write_sheets
from vidtrack.output.scene import newest_scene
from vidtrack.traffic.report.close import close_of
from vidtrack.traffic.report.findings import Findings
from vidtrack.traffic.report.legs import legs_of
from vidtrack.traffic.report.paths import Paths, paths_of
from vidtrack.traffic.report.sheet import WATCHED, Sheet, intervals_of_an_hour, peak_hour, sheet_of
from vidtrack.traffic.report.speeds import speeds_of
from vidtrack.traffic.report.turns import drawn, turns
from vidtrack.traffic.validation.audit import Reviewed
from vidtrack.video.frame import Image


def write_report(folder: Path, found: Findings, scene: Image | None, reviewed: Reviewed | None = None) -> None:
    """Write report.html, NAME.png and NAME.csv of all that the tables allow.

    scene     (H, W, 3) a picture of the site, under the arrows; None: the scene of the newest run that has one
    reviewed  what somebody found who looked at the crossings, shown beside the counts; None: nobody did

    Raises ConfigError for a site that cannot be drawn, StoppedEarly on a full disk.
    """
    if scene is None:
        scene = newest_scene((Path(run["folder"]) for run in found.report["runs"]), found.site)
    sheet = sheet_of(found, turns(drawn(found.site)))
    peak = peak_hour(sheet.total, found.coverage >= WATCHED, found.edges)
    paths, gone = _paths(found, sheet)
    why_no_peak = "" if peak else _why_no_peak(found)
    legs, speeds, close = legs_of(found), speeds_of(found), close_of(found)
    page = Page(found, sheet, peak, why_no_peak, legs, speeds, paths, close, scene is not None, reviewed)
    missing = _missing(page, gone)
    made = _pictures(page, scene, missing)
    for name, content in made.items():
        with replacing(folder / f"{name}.png") as new:
            new.write_bytes(content)
    write_sheets(folder, page)
    with replacing(folder / "report.html") as new:
        new.write_text(rendered(page, made, missing), encoding="utf-8")


def _paths(found: Findings, sheet: Sheet) -> tuple[Paths | None, str]:
    """The paths, or why there are none: the runs may be gone, and the rest of the report does not need them."""
    try:
        return paths_of(found, sheet), ""
    except Error as error:
        return None, str(error)


def _why_no_peak(found: Findings) -> str:
    whole = intervals_of_an_hour(found.edges)
    if whole is None:
        return "an hour is not a whole number of intervals"
    unwatched = np.flatnonzero(np.concatenate([[True], found.coverage < WATCHED, [True]]))
    if np.diff(unwatched).max() - 1 < whole:
        return "no hour of whole intervals was watched"
    return "no vehicle was counted"


def _missing(page: Page, gone: str) -> dict[str, str]:
    """Why pictures are not there, by name; `gone`: why there are no paths."""
    no_movement = "" if page.sheet.movements else "the site has no entry gate with an exit gate on another leg"
    no_entry = "" if page.legs else "the site has no entry gate"
    no_metres = "" if page.found.metres else "without a calibration nobody knows whether a vehicle stands"
    no_queue = "" if any((leg.queue > 0).any() for leg in page.legs) else "no vehicle was seen to queue"
    no_speed = "no speed was measured: without a calibration only sections with a length give speeds"
    no_speed = no_speed if page.found.site.gates else "the site has no gates, where speeds are measured"
    ways = None if page.paths is None else page.paths.ways
    reasons = {
        "turning_movements": no_movement,
        "origin_destination": no_movement,
        "speeds": "" if page.speeds else no_speed,
        "flow": no_entry,
        "queues": no_entry or no_metres or no_queue,
        "heat_map": gone,
        "time_space": gone or ("" if ways is not None and len(ways.t) else "there is no whole trip to draw"),
    }
    return {name: why for name, why in reasons.items() if why}


def _pictures(page: Page, scene: Image | None, missing: dict[str, str]) -> dict[str, bytes]:
    """PNG files by name, of all that are not missing."""
    found, legs, paths = page.found, page.legs, page.paths
    when = found.clock, found.edges, found.coverage
    made = {"coverage": charts.coverage_strip(*when)}
    if "turning_movements" not in missing:
        made["turning_movements"] = charts.movements(page.sheet, page.peak, found.clock)
        made["origin_destination"] = pictures.origins(found.site, page.sheet, scene)
    if "speeds" not in missing:
        made["speeds"] = charts.speed_histograms(page.speeds)
    if "flow" not in missing:
        made["flow"] = charts.over_the_day(legs, [leg.flow for leg in legs], "vehicles/h", *when)
    if "queues" not in missing:
        made["queues"] = charts.over_the_day(legs, [leg.queue for leg in legs], "longest queue, vehicles", *when)
    if paths is not None:
        made["heat_map"] = pictures.heat_map(paths.heat, paths.gates, found.metres)
        if paths.ways is not None and "time_space" not in missing:
            made["time_space"] = charts.time_space(paths.ways, found.clock, "m" if found.metres else "px")
    return made
