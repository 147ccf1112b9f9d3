"""The road of a site, as a run needs it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from vidtrack.traffic.lines import Line, segments

if TYPE_CHECKING:
    from vidtrack.traffic.footprint import Footprints

SITE_COPY = "site.toml"
"""Name of the copy of a site in the folder of a run."""


@dataclass(frozen=True, slots=True)
class UsedSite:
    """What a run takes from the file of a site, all of one reading.

    text     of the file
    road     where vehicles stand on the road; None without a calibration
    classes  low and high length of each class [m]; empty without a calibration
    gates    as lines in the pictures
    masked   corners of the areas in which nothing is tracked [px]
    """

    text: str
    road: Footprints | None
    classes: Mapping[str, tuple[float, float]]
    gates: tuple[Line, ...] = ()
    masked: tuple[tuple[tuple[float, float], ...], ...] = ()


def used_site(site: Path, width: int, height: int) -> UsedSite:
    """Read the site in a file.

    width, height  px of the pictures. Raises ConfigError for a bad file, or pictures of another shape than the site's.
    """
    from vidtrack.config.group import read_toml_text
    from vidtrack.traffic.calibration.calibrate import calibrated  # loads SciPy's optimisers
    from vidtrack.traffic.footprint import Footprints
    from vidtrack.traffic.site import parse_site

    text = read_toml_text(site, "site")
    drawn = parse_site(text, site).scaled(width, height)
    gates = tuple(line for name, gate in drawn.gates.items() for line in segments(name, gate.line))
    if drawn.calibration is None:
        return UsedSite(text, None, {}, gates, drawn.masked)
    road = Footprints(calibrated(drawn), (width, height), drawn.classes)
    return UsedSite(text, road, drawn.classes, gates, drawn.masked)


def footprints_of(site: Path | None, width: int, height: int) -> Footprints | None:
    """Where vehicles stand on the road of the site in a file; None without a site, or without a calibration in it.

    Raises ConfigError as `used_site` does.
    """
    return None if site is None else used_site(site, width, height).road
