"""Turning counts in the Universal Traffic Data Format: the file of volumes that Synchro and its like read."""

from __future__ import annotations

from collections.abc import Iterable
from datetime import timedelta
from pathlib import Path

import numpy as np

from vidtrack.arrays.types import Floats
from vidtrack.errors import ConfigError
from vidtrack.output.folder import replacing
from vidtrack.traffic.report.findings import Findings
from vidtrack.traffic.report.sheet import WATCHED, sheet_of
from vidtrack.traffic.report.turns import LEFT, RIGHT, THROUGH, U_TURN, Drawn, drawn, headings, turns

INTERVAL_S = 900.0
_FOUR = ("NB", "EB", "SB", "WB")
_EIGHT = ("NB", "NE", "EB", "SE", "SB", "SW", "WB", "NW")
"""Ways of travel, clockwise from north"""
_LETTER = {U_TURN: "U", LEFT: "L", THROUGH: "T", RIGHT: "R"}
_FROM = {"north": "SB", "east": "WB", "south": "NB", "west": "EB"}
"""The way of travel from a leg that is named so"""
_INTERSECTION = 1


def write(found: Findings, folder: Path) -> str:
    """Write Volume.csv: a row for each interval that was watched whole, a column for each movement; what was left out.

    An approach is named by the way that vehicles travel: NB comes from the south. Raises ConfigError where intervals
    are not 15 minutes, the time is not known, or the ways of travel are not.
    """
    step, zero = float(found.edges[1] - found.edges[0]), found.clock.zero
    if abs(step - INTERVAL_S) > 1e-6:
        raise ConfigError(
            f"utdf holds 15-minute counts, these are of {step:g} s; give [report] interval_s = 900 and measure again"
        )
    if zero is None:
        raise ConfigError(
            f"utdf needs dates, and the site {found.site.camera.name} has none: give [site] the time of the first "
            "picture, for example start = 2026-06-01T07:00:00+02:00, and measure again"
        )
    where = drawn(found.site)
    sheet = sheet_of(found, turns(where))
    if not sheet.movements:
        raise ConfigError(
            f"utdf holds turning counts, and the site {found.site.camera.name} has no entry gate with an exit gate on "
            "another leg; draw them and measure again"
        )
    ways = approaches(found, where, {movement.start for movement in sheet.movements})
    columns = [f"{way}{letter}" for way in _FOUR for letter in "LTR"]
    count = {name: np.zeros(len(found.coverage)) for name in columns}
    for movement, trips in zip(sheet.movements, sheet.count.T, strict=True):
        if movement.turn not in _LETTER:
            raise ConfigError(
                f"utdf needs left, through and right, and from {movement.start} to {movement.end} the gates do not tell"
            )
        name = ways[movement.start] + _LETTER[movement.turn]
        count[name] = count.get(name, 0) + trips
    whole = np.flatnonzero(found.coverage >= WATCHED)
    with replacing(folder / "Volume.csv") as path, path.open("w", newline="\r\n", encoding="ascii") as file:
        file.write("Turning Movement Count\n15 Minute Counts\n")
        file.write(",".join(["DATE", "TIME", "INTID", *count]) + "\n")
        for k in whole.tolist():
            begin = zero + timedelta(seconds=round(float(found.edges[k])))
            numbers = (f"{column[k]:.0f}" for column in count.values())
            file.write(",".join([begin.strftime("%m/%d/%Y,%H%M"), str(_INTERSECTION), *numbers]) + "\n")
    intervals = f"{len(whole)} interval{'s' * (len(whole) != 1)}"
    return f"{intervals} of {len(found.coverage)}: those that were not watched whole are left out"


def approaches(found: Findings, where: Drawn, legs: Iterable[str]) -> dict[str, str]:
    """The way of travel of each leg: by its gates on a site with ground points, else by its name.

    Raises ConfigError where neither tells, and where two legs have the same.
    """
    calibration = found.site.calibration
    if calibration is not None and calibration.picture:
        into = headings(where, "entry", 1.0)
        for names in (_FOUR, _EIGHT):
            ways = {leg: _compass(into[leg], names) for leg in legs if leg in into}
            if len(set(ways.values())) == len(ways):
                break
    else:
        ways = {leg: _FROM[leg.lower()] for leg in legs if leg.lower() in _FROM}
    for leg in legs:
        if leg not in ways:
            raise ConfigError(
                f"utdf needs to know which way vehicles from {leg} travel: give the calibration ground points (x east, "
                "y north), or name the legs north, east, south and west"
            )
        others = [other for other in ways if other != leg and ways[other] == ways[leg]]
        if others:
            raise ConfigError(f"vehicles from {leg} and {others[0]} both travel {ways[leg]}; utdf has no two such legs")
    return ways


def _compass(heading: Floats, names: tuple[str, ...]) -> str:
    """The nearest of ways that are named clockwise from north."""
    turn = np.arctan2(heading[0], heading[1]) / (2 * np.pi)
    return names[round(turn * len(names)) % len(names)]
