"""Lists of the sinks of runs in pixels: tables, and outputs with pictures."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

from vidtrack.config.settings import Settings
from vidtrack.estimate.motion.model import Motion
from vidtrack.output.confirmed import Confirmed
from vidtrack.output.counts import CountsFile
from vidtrack.output.decisions import DecisionLog
from vidtrack.output.linked import Linked
from vidtrack.output.masks import MaskFolder
from vidtrack.output.mot import MotFile
from vidtrack.output.plot import TrajectoryPlot
from vidtrack.output.sink import Sink
from vidtrack.output.site_copy import SiteCopy
from vidtrack.output.smoothed import smoothed_first
from vidtrack.output.summary import Summary
from vidtrack.output.tables import TrackTable
from vidtrack.output.thinned import Thinned
from vidtrack.output.threaded import Threaded
from vidtrack.run.run import Extras
from vidtrack.traffic.lines import Line, LineCounter, parse_lines
from vidtrack.traffic.metres import UsedSite, used_site
from vidtrack.video.frame import Image
from vidtrack.video.stats import SourceStats

if TYPE_CHECKING:
    from vidtrack.traffic.footprint import Footprints


@dataclass(frozen=True, slots=True)
class Subject:
    """The source and settings of a run, as the sinks need them.

    source    name in summary.json, without any password
    settings  of the run
    shape     (H, W) of the pictures
    fps       nominal rate [1/s]
    scene     returns the (H, W, 3) background; None: there are no pictures
    reading   returns the source's counters, see Summary
    counter   line counter; None without counting lines
    road      positions on the road; None without a calibrated site
    site      text of the site's file; None without a site
    classes   low and high length of each class [m]; empty without a calibrated site
    """

    source: str
    settings: Settings
    shape: tuple[int, int]
    fps: float
    scene: Callable[[], Image] | None
    reading: Callable[[], Mapping[str, object]]
    counter: LineCounter | None
    road: Footprints | None
    site: str | None = None
    classes: Mapping[str, tuple[float, float]] = field(default_factory=dict)

    def at(self, site: UsedSite) -> Subject:
        """The same source, seen at this site."""
        return replace(self, road=site.road, site=site.text, classes=site.classes)

    @property
    def looked_at_fps(self) -> float:
        """Nominal rate of the steps [1/s]."""
        return self.settings.source.looked_at_fps(self.fps)

    @property
    def lines(self) -> Sequence[Line]:
        """The counted lines."""
        return self.counter.lines if self.counter else ()

    def summary(self, folder: Path, counts: Callable[[], Mapping[str, Mapping[str, int]]] | None = None) -> Summary:
        """Opens summary.json in a folder, with these counts instead of those of the whole run."""
        path, counts = folder / "summary.json", counts or (self.counter.totals if self.counter else None)
        return Summary(path, self.source, self.settings, self.reading, counts, usual_s=1 / self.looked_at_fps)


class FileSource(Protocol):
    """What a subject reads of the source of a file."""

    width: int
    height: int
    fps: float
    stats: SourceStats


def line_counter(settings: Settings, width: int, height: int, *, refuse: bool = False) -> LineCounter | None:
    """A counter for the lines in the settings, in a picture of this size [px]; None without lines.

    refuse  lines outside the picture, whose size is known, as `parse_lines` does
    """
    lines = parse_lines(settings.output.lines, width, height, refuse=refuse)
    return LineCounter(lines) if lines else None


def file_subject(
    path: str,
    source: FileSource,
    rates: Callable[[], Mapping[str, float]],
    settings: Settings,
    scene: Callable[[], Image] | None,
) -> Subject:
    """The subject of a file, `path` as the user wrote it. Raises ConfigError for a bad line or site.

    rates  returns the tracker's estimates
    scene  returns the (H, W, 3) background; None: there are no pictures, and their size is estimated
    """
    stats = source.stats

    def reading() -> dict[str, object]:
        return {
            "fps": round(source.fps, 6),
            "width": source.width,
            "height": source.height,
            "frames_read": stats.frames_read,
            "frames_dropped": stats.frames_dropped,
            "decode_errors": stats.decode_errors,
            "reconnects": 0,
            "stalls": 0,
            "truncated": stats.truncated,
            **rates(),
        }

    counter = line_counter(settings, source.width, source.height, refuse=scene is not None)
    subject = Subject(path, settings, (source.height, source.width), source.fps, scene, reading, counter, None)
    site = settings.output.site
    return subject if site is None else subject.at(used_site(site, source.width, source.height))


def file_sinks(
    subject: Subject,
    extras: Extras,
    folder: Path,
    *,
    motion: Motion,
    smooth: bool,
    link_s: float | None,
    hold_s: float,
) -> Iterator[Sink]:
    """The sinks of a run over a file.

    motion  the tracker's motion model, for links
    smooth  the tracker keeps what the smoother needs, and tables are smoothed, each track as far as it is not broken
    link_s  longest gap over which broken tracks are joined [s]; None: they are not joined
    hold_s  longest time that rows wait for the confirmation of their track [s]
    """
    counter, output = subject.counter, subject.settings.output
    if subject.site is not None:
        yield SiteCopy(folder, subject.site)
    if counter is not None:
        yield CountsFile(folder / "counts.csv", counter)
    tables = _tables(subject, folder)
    if tables and output.every_s:
        tables = (Thinned(*tables, every_s=output.every_s),)
    if tables:
        tables = smoothed_first(smooth, output.smooth_lag_s, *tables)
    if tables and link_s is not None:
        tables = (Linked(*tables, motion=motion, longest_s=link_s),)
    if tables:
        yield Confirmed(*tables, hold_s=hold_s)
    if extras.decisions:
        yield DecisionLog(folder / "decisions.csv")
    for _, sink in picture_sinks(subject, extras):
        yield Threaded(sink)


def _tables(subject: Subject, folder: Path) -> tuple[Sink, ...]:
    """The files of tracks that output.level asks for."""
    level, counter = subject.settings.output.level, subject.counter
    if level == "counts":
        return ()
    table = TrackTable(folder, road=subject.road, text=level == "all")
    if level == "tracks":
        return (table,)
    totals = counter.totals if counter else None
    plot = TrajectoryPlot(folder / "tracks.png", subject.shape, subject.scene, subject.lines, totals)
    return (table, MotFile(folder / "mot.txt"), plot)


def picture_sinks(subject: Subject, extras: Extras) -> Iterator[tuple[str, Sink]]:
    """Names and sinks of masks, annotated video and rerun, which are slow and run in threads of their own."""
    settings = subject.settings
    if extras.masks is not None:
        yield "masks", MaskFolder(extras.masks)
    if extras.video is not None:
        from vidtrack.output.video import AnnotatedVideo

        yield "video", AnnotatedVideo(extras.video, subject.looked_at_fps, settings.output, subject.lines)
    if extras.rerun is not None:
        from vidtrack.output.rerun.pictures import RerunSink

        yield "rerun", RerunSink(extras.rerun, subject.shape, settings, subject.lines)
