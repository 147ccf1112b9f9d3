"""report.html: one file with pictures inside and nothing from elsewhere."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib.metadata import version
from itertools import groupby
from typing import Any

import numpy as np
from jinja2 import Environment, PackageLoader, StrictUndefined

from vidtrack.traffic.measures.doubts import against
from vidtrack.traffic.report.close import Close
from vidtrack.traffic.report.findings import CONFLICTS, Findings
from vidtrack.traffic.report.legs import LegDay
from vidtrack.traffic.report.paths import Paths
from vidtrack.traffic.report.sheet import PeakHour, Sheet, peak_hour_factor
from vidtrack.traffic.report.speeds import Speeds
from vidtrack.traffic.validation.audit import Reviewed

NOT_KNOWN = "–"
CHECKS = {
    "inflow": "vehicles in over entry gates",
    "outflow": "vehicles out over exit gates",
    "left_over": "in − out − growth of the number inside; 0 where none was lost or made",
    "appeared": "appeared between the gates",
    "vanished": "vanished between the gates",
}


@dataclass(frozen=True, slots=True)
class Page:
    """All that the page says. `why_no_peak`: in words, where `peak` is None; `scene`: a picture is under the arrows.

    reviewed  what somebody found who looked at the crossings; None: nobody did
    """

    found: Findings
    sheet: Sheet
    peak: PeakHour | None
    why_no_peak: str
    legs: Sequence[LegDay]
    speeds: Sequence[Speeds]
    paths: Paths | None
    close: Close | None
    scene: bool
    reviewed: Reviewed | None = None

    @property
    def times(self) -> list[str]:
        """(I + 1,) the ends of the intervals in words."""
        return [self.found.clock.label(t) for t in self.found.edges]

    @property
    def peaks(self) -> list[tuple[str, float, float, float, float]]:
        """Volume, factor and bounds in the peak hour: of all vehicles, then of each leg they came from."""
        if self.peak is None:
            return []
        hour = slice(self.peak.first, self.peak.last)
        legs = dict.fromkeys(movement.start for movement in self.sheet.movements)
        counts = [("all", self.sheet.total[hour]), *((leg, self.sheet.of_leg(leg)[hour]) for leg in legs)]
        return [(name, float(count.sum()), *peak_hour_factor(count)) for name, count in counts]

    @property
    def origins(self) -> dict[str, dict[str, float]]:
        """Trips from leg to leg."""
        matrix: dict[str, dict[str, float]] = {}
        for movement, trips in zip(self.sheet.movements, self.sheet.sums.tolist(), strict=True):
            matrix.setdefault(movement.start, {})[movement.end] = trips
        return matrix

    @property
    def closest(self) -> list[dict[str, Any]]:
        """The closest conflicts, by column; what is not known is NaN or None."""
        if self.close is None:
            return []
        table = self.found.tables["conflicts"].take(self.close.closest)
        return [{name: row[name] for name in CONFLICTS} for row in table.to_pylist()]

    @property
    def checks(self) -> list[tuple[str, str, float]]:
        """Column, words and sum over the watched intervals."""
        return [(name, words, float(np.nansum(self.found.numbers("checks", name)))) for name, words in CHECKS.items()]


def rendered(page: Page, drawn: Mapping[str, bytes], missing: Mapping[str, str]) -> str:
    """The page; all words in it are escaped."""
    environment = Environment(
        loader=PackageLoader("vidtrack.output.report", ""),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {"number": _number, "share": _share}
    report, found = page.found.report, page.found
    complete = int((found.numbers("trips", "complete") > 0).sum())
    return environment.get_template("page.html").render(
        page=page,
        found=found,
        report=report,
        against=against(report) if found.metres else [],
        unchecked=found.metres and "calibration" not in report,
        clock=found.clock,
        date=found.clock.date(float(found.edges[0])),
        pictures={name: f"data:image/png;base64,{b64encode(content).decode()}" for name, content in drawn.items()},
        missing=missing,
        groups=[(leg, len(list(ours))) for leg, ours in groupby(page.sheet.movements, lambda one: one.start)],
        destinations=list(dict.fromkeys(to for row in page.origins.values() for to in row)),
        interval=_interval(float(found.edges[1] - found.edges[0])),
        watched=_duration(float(report["watched_s"])),
        interval_share=float(report["watched_s"]) / float(found.edges[-1] - found.edges[0]),
        complete=complete,
        incomplete=found.tables["trips"].num_rows - complete,
        impossible=sum(one["trips"] for one in report["impossible_movements"]),
        version=version("vidtrack"),
    )


def _number(value: float | None, digits: int = 0) -> str:
    return NOT_KNOWN if value is None or not np.isfinite(value) else f"{value:.{digits}f}"


def _share(value: float) -> str:
    """Per cent; neither 0 nor 100 unless it is exactly that."""
    percent = 100 * value
    if 0 < percent < 1 or 99 < percent < 100:
        return f"{percent:.1f} %"
    return f"{percent:.0f} %"


def _interval(seconds: float) -> str:
    return f"{seconds:g} s" if seconds % 60 else f"{seconds / 60:.0f} min"


def _duration(seconds: float) -> str:
    hours, minutes = divmod(round(seconds / 60), 60)
    if seconds < 600:
        return f"{seconds:.0f} s"
    return f"{hours} h {minutes:02d} min" if hours else f"{minutes} min"
