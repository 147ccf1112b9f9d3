"""A run of the radar: a plot table tracked into a folder of results."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from types import TracebackType

from vidtrack.config import Settings
from vidtrack.output.confirmed import Confirmed
from vidtrack.output.decisions import DecisionLog
from vidtrack.output.folder import begun
from vidtrack.output.linked import refuse_link
from vidtrack.output.radar_plot import RadarPlot
from vidtrack.output.results import Results
from vidtrack.output.sink import Step
from vidtrack.output.smoothed import smoothed_first
from vidtrack.output.summary import Summary
from vidtrack.output.tables import RADAR, RADAR_3D, TrackTable
from vidtrack.output.threaded import Threaded
from vidtrack.radar.plots import read_plots
from vidtrack.radar.scans import measurements
from vidtrack.radar_pipeline import build_radar_tracker
from vidtrack.steps import scan_steps


class RadarRun:
    """Iterates over the scans of a plot table while the results are written; use it with `with`.

    folder  where the results are
    name, scans  of the table

    Leaving the `with` block, whatever the reason, ends all results as complete and valid up to the last whole scan;
    `summary.json` says whether the run was interrupted.
    Raises SourceError, PlotFormatError, ConfigError, OutputError at the start, StoppedEarly when results cannot be
    written on.
    """

    def __init__(
        self,
        path: str,
        settings: Settings,
        output: Path | None = None,
        *,
        force: bool = False,
        rerun: str | None = None,
        decisions: bool = False,
        seed: int = 0,
    ) -> None:
        plots = read_plots(path, settings.radar)
        found = measurements(plots, settings.radar)
        refuse_link(settings.output, "radar runs")
        tracker = build_radar_tracker(settings, found, explain=decisions or rerun is not None, seed=seed)
        self.name, self.scans = Path(path).stem, found.count
        account = {"plots": len(plots), "bad_rows": plots.bad_rows, "truncated": False}
        with begun(output, self.name, force) as self.folder, ExitStack() as stack:  # what fails below leaves nothing
            summary = Summary(
                self.folder / "summary.json", path, settings, lambda: account | tracker.rates.as_dict(), unit="scans"
            )
            results = stack.enter_context(Results(summary))
            table = TrackTable(self.folder, RADAR if found.dim == 2 else RADAR_3D)
            plot = RadarPlot(self.folder / "tracks.png", settings.radar.position[:2])
            sinks = smoothed_first(settings.output, table, plot)
            results.add(Confirmed(*sinks, hold_s=math.inf))  # scans may be far apart, and a file ends
            if decisions:
                results.add(DecisionLog(self.folder / "decisions.csv", index="scan"))
            if rerun is not None:
                from vidtrack.output.rerun_radar import RadarRerun

                results.add(Threaded(RadarRerun(rerun, settings)))
            self._steps = results.record(scan_steps(found, tracker, settings.tracker.redundant))
            self._open = stack.pop_all()

    def __iter__(self) -> Iterator[Step]:
        return self._steps

    def __enter__(self) -> RadarRun:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._open.__exit__(kind, error, trace)
