"""`vidtrack view`: shows a finished run in rerun."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import click

from vidtrack.cli.options import Options, common, receives, start_log


@dataclass(frozen=True, kw_only=True)
class ViewOptions(Options):
    """Options of `vidtrack view`."""

    run: Path
    save: str | None
    video: bool


@click.command(
    name="view",
    epilog="""\b
Examples:
  vidtrack view runs/motorway
  vidtrack view runs/motorway --save motorway.rrd
  vidtrack view runs/motorway --no-video""",
)
@click.argument("run", type=click.Path(path_type=Path))
@common("Folder for a recording view.rrd, instead of starting the viewer.")
@click.option("--save", metavar="FILE.rrd", help="Write a recording instead of starting the viewer.")
@click.option("--video/--no-video", default=True, help="Show the pictures of the source, if it is still there.")
@receives(ViewOptions)
def command(options: ViewOptions) -> None:
    """Show the tracks of the folder RUN over its video, over the background in tracks.png without one, or, of a radar's
    run, in metres.

    What the table does not hold is not shown: masks, blobs, and the reasons of decisions. Record these
    while tracking, with --rerun.
    """
    start_log(options.verbose, options.quiet)  # before importing rerun, which starts its own log
    from contextlib import ExitStack, closing

    from vidtrack.errors import SourceError
    from vidtrack.output import replay
    from vidtrack.output.rerun.pictures import RerunSink
    from vidtrack.output.rerun.plots import RadarRerun
    from vidtrack.traffic.lines import parse_lines
    from vidtrack.video.source import open_source

    finished = replay.read_run(options.run)
    save = options.save
    if save is None and (folder := options.folder("view")) is not None:
        save = str(folder / "view.rrd")
    if finished.shape is None:
        with closing(RadarRerun(save or "spawn", finished.settings)) as radar:
            for step in replay.steps(finished):
                radar.step(step)
        return
    height, width = finished.shape
    lines = parse_lines(finished.settings.output.lines, width, height)
    with ExitStack() as stack:
        sink = stack.enter_context(closing(RerunSink(save or "spawn", finished.shape, finished.settings, lines)))
        frames = None
        if options.video:
            try:
                frames = stack.enter_context(open_source(finished.source, finished.settings.source))
            except SourceError as error:
                click.echo(f"vidtrack: {error}; the background of tracks.png is shown instead", err=True)
        if frames is None:
            sink.background(replay.background(options.run, finished.shape))
        for step in replay.steps(finished, frames):
            sink.step(step)
