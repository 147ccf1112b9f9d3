"""The page that leads to the reports of all sites and days of an archive."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from jinja2 import Environment, PackageLoader

from vidtrack.output.folder import replacing


@dataclass(frozen=True, slots=True)
class DayLine:
    """A site's day: address of its report, seconds that were watched, and counts."""

    site: str
    day: str
    address: str
    watched_s: float
    crossings: int
    trips: int
    complete_trips: int


def write_contents(folder: Path, lines: Sequence[DayLine]) -> None:
    """Write report.html with a line for each day and the sums of each site. Raises StoppedEarly on a full disk."""
    sites = [[line for line in lines if line.site == name] for name in dict.fromkeys(line.site for line in lines)]
    page = Environment(loader=PackageLoader("vidtrack.output.report", ""), autoescape=True).get_template("archive.html")
    with replacing(folder / "report.html") as new:
        new.write_text(page.render(sites=sites), encoding="utf-8")
