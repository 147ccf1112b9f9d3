"""`vidtrack track`: a video, an image folder or stored detections become tracks."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from vidtrack.cli.options import common, settings_options, start_log


@click.command(
    name="track",
    epilog="""\b
Examples:
  vidtrack track traffic.avi
  vidtrack track traffic.mp4 -o result --line north:0,150,320,150 --video annotated.mp4
  vidtrack track frames/ --fps 25 --method nn --rerun run.rrd""",
)
@click.argument("source")
@common("Folder for the results.  [default: runs/NAME]")
@settings_options
@click.option("--method", type=click.Choice(["nn", "gnn"]), help="Association.  [default: gnn]")
@click.option(
    "--distance",
    type=click.Choice(["mahalanobis", "decoupled", "euclidean"]),
    help="What decides which blob is whose.  [default: mahalanobis]",
)
@click.option(
    "--detector",
    type=click.Choice(["disturbance", "paper", "mog2", "knn"]),
    help="How vehicles are told from the scene.  [default: disturbance]",
)
@click.option("--rerun", metavar="FILE.rrd|spawn|serve", help="Record or show everything in rerun.")
@click.option("--video", type=click.Path(path_type=Path), metavar="FILE.mp4", help="Write an annotated video.")
@click.option("--save-masks", type=click.Path(path_type=Path), metavar="DIR", help="Write each frame's mask as PNG.")
@click.option("--line", "lines", multiple=True, metavar="NAME:x1,y1,x2,y2", help="Count over a line; repeat for more.")
@click.option("--decisions", is_flag=True, help="Write why each track got what it got.")
@click.option("--start", type=float, metavar="S", help="Begin at this time [s].")
@click.option("--end", type=float, metavar="S", help="Stop at this time [s].")
@click.option("--scale", type=float, metavar="F", help="Detect in a reduced picture: 1/2, 1/3, ...")
@click.option("--mask", type=click.Path(path_type=Path), metavar="IMAGE", help="Only where this picture is white.")
@click.option("--fps", type=float, metavar="N", help="True frames/s, where the input carries no times or wrong ones.")
def command(
    source: str,
    output: Path | None,
    seed: int,
    force: bool,
    quiet: bool,
    verbose: int,
    config_file: Path | None,
    assignments: tuple[str, ...],
    rerun: str | None,
    video: Path | None,
    save_masks: Path | None,
    decisions: bool,
    **chosen: Any,
) -> None:
    """Track the vehicles in SOURCE: a video file, an image folder or glob, or a MOT det.txt.

    The results' folder is printed. It holds tracks.csv, tracks.parquet, mot.txt, summary.json and
    tracks.png. Ctrl-C ends with complete results up to then. --seed is accepted for uniformity:
    tracking draws no random numbers.
    """
    from vidtrack.cli.progress import progress
    from vidtrack.cli.signals import Terminated, stoppable
    from vidtrack.compiled import first_run
    from vidtrack.config import load
    from vidtrack.run import Run

    start_log(verbose, quiet)
    settings = load(config_file, [*assignments, *_assignments(chosen)])
    if first_run() and not quiet:
        click.echo("vidtrack: compiling for this machine, once; it takes about half a minute", err=True)
    with Run(
        source, settings, output, force=force, rerun=rerun, video=video, masks=save_masks, decisions=decisions
    ) as run:
        try:
            for _ in stoppable(progress(run, run.frames, run.name, quiet)):
                pass  # the sinks have seen it
        except (KeyboardInterrupt, Terminated):
            click.echo(f"vidtrack: the results up to here are in {run.folder}", err=True)
            raise
    click.echo(run.folder)


_SETTING = {
    "method": "tracker.method",
    "distance": "tracker.distance",
    "detector": "detector.kind",
    "start": "source.start_s",
    "end": "source.end_s",
    "scale": "source.scale",
    "mask": "source.mask",
    "fps": "source.fps",
}


def _assignments(chosen: dict[str, Any]) -> list[tuple[str, Any]]:
    """The options that stand for a setting, as (name, value)."""
    given = [(_SETTING[name], chosen[name]) for name in _SETTING if chosen[name] is not None]
    return given + ([("output.lines", list(chosen["lines"]))] if chosen["lines"] else [])
