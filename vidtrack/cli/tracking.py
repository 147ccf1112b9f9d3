"""Options common to all commands that track."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar, get_args

import click

from vidtrack.cli.options import WithSettings
from vidtrack.config import names

if TYPE_CHECKING:
    from vidtrack.run.run import Run

Function = TypeVar("Function", bound=Callable[..., Any])


@dataclass(frozen=True, kw_only=True)
class TrackingOptions(WithSettings):
    """See `association_options`."""

    method: str | None
    distance: str | None
    rerun: str | None
    decisions: bool


@dataclass(frozen=True, kw_only=True)
class PictureOptions(TrackingOptions):
    """See `picture_options`."""

    detector: str | None
    video: Path | None
    save_masks: Path | None
    lines: tuple[str, ...]
    site: Path | None
    start: float | None
    end: float | None
    max_fps: float | None
    scale: float | None
    mask: Path | None
    decoder: str | None


def _recording(_context: click.Context, _option: click.Parameter, value: str | None) -> str | None:
    """Check the value of --rerun: a misspelt "spawn" must not become a file name."""
    if value is None or value in ("spawn", "serve") or value.endswith(".rrd"):
        return value
    raise click.BadParameter(f"{value!r} is not FILE.rrd, spawn or serve.")


def _mp4(_context: click.Context, _option: click.Parameter, value: Path | None) -> Path | None:
    """Check the value of --video: players rely on the extension."""
    if value is None or value.suffix.lower() == ".mp4":
        return value
    raise click.BadParameter(f"the annotated video is an MP4; name it {value.stem or 'FILE'}.mp4, not {value}.")


def choice(kind: Any) -> click.Choice:
    """A choice among the names in a Literal."""
    return click.Choice(get_args(kind))


def association_options(function: Function) -> Function:
    """--method, --distance, --rerun, --decisions, for pictures and plots."""
    for option in (
        click.option("--decisions", is_flag=True, help="Write why each track got what it got."),
        click.option(
            "--rerun",
            metavar="FILE.rrd|spawn|serve",
            callback=_recording,
            help="Record or show everything in rerun.",
        ),
        click.option(
            "--distance",
            type=choice(names.Distance),
            help="What decides which measurement is whose.  [default: mahalanobis]",
        ),
        click.option("--method", type=choice(names.Method), help="Association.  [default: gnn]"),
    ):
        function = option(function)
    return function


_OPTIONS = (
    click.option(
        "--detector",
        type=choice(names.Detector),
        help="How vehicles are told from the scene.  [default: disturbance]",
    ),
    click.option(
        "--video",
        type=click.Path(path_type=Path),
        metavar="FILE.mp4",
        callback=_mp4,
        help="Write an annotated video.",
    ),
    click.option(
        "--save-masks", type=click.Path(path_type=Path), metavar="DIR", help="Write each frame's mask as PNG."
    ),
    click.option(
        "--line",
        "lines",
        multiple=True,
        metavar="NAME:x1,y1,x2,y2",
        help="Count over a line, in pixels; repeat for more.",
    ),
    click.option(
        "--site",
        type=click.Path(path_type=Path),
        metavar="SITE.toml",
        help="Add positions in metres and speeds, by this site's calibration.",
    ),
    click.option("--start", type=float, metavar="S", help="Begin at this time [s]."),
    click.option("--end", type=float, metavar="S", help="Stop at this time [s]."),
    click.option("--max-fps", type=float, metavar="N", help="Look at no more than N pictures a second."),
    click.option("--scale", type=float, metavar="F", help="Detect in a reduced picture: 0.5, 0.333, ..."),
    click.option("--mask", type=click.Path(path_type=Path), metavar="IMAGE", help="Only where this picture is white."),
    click.option(
        "--decoder", type=choice(names.Decoder), help="Hardware that decodes, if there is any.  [default: software]"
    ),
)


def picture_options(function: Function) -> Function:
    """--method, --distance, --detector, --rerun, --video, --save-masks, --line, --site, --decisions, --start, ..."""
    for option in reversed(_OPTIONS):
        function = option(function)
    return association_options(function)


def smooth_option(default: str) -> Callable[[Function], Function]:
    """--smooth, for files; `default` says when it is so by itself."""
    text = f"Let each row know what came after it; rows appear later.  [default: {default}]"
    return click.option("--smooth/--no-smooth", default=None, help=text)


def finish(run: Run, quiet: bool, unit: str = "frame", none: str = "no tracks") -> None:
    """Complete a run over a file and print its outcome; `none` is the text without tracks."""
    from vidtrack.cli.progress import progress, report_outcome
    from vidtrack.cli.signals import stoppable

    with run, _broken_off(run):
        for _ in stoppable(progress(run, run.count, run.name, quiet, unit)):
            pass  # the run has passed the step to its sinks
    report_outcome(run.folder, quiet, none)
    click.echo(run.folder)


def finish_feed(run: Run, stop: Callable[[], None], quiet: bool) -> None:
    """Complete a run over what comes from the network; Ctrl-C and SIGTERM call `stop`, which is its normal end.

    After Ctrl-C what was heard is tracked to the end, however long kernels are compiled for it: it does not come again.
    A second one breaks it off.
    """
    from vidtrack.cli.progress import progress, report_outcome
    from vidtrack.cli.signals import stopping

    def late() -> None:
        if not quiet:
            click.echo("vidtrack: tracking what was heard before; Ctrl-C again ends it at once", err=True)

    with run, _broken_off(run), stopping(stop, late):
        for _ in progress(run, run.count, run.name, quiet, "scan"):
            pass  # the run has passed the step to its sinks
    report_outcome(run.folder, quiet, "no tracks")
    click.echo(run.folder)


@contextmanager
def _broken_off(run: Run) -> Iterator[None]:
    """Say where the results are when a signal breaks off a run."""
    from vidtrack.cli.signals import Terminated

    try:
        yield
    except (KeyboardInterrupt, Terminated):
        click.echo(f"vidtrack: the results up to here are in {run.folder}", err=True)
        raise
