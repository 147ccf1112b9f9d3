"""`vidtrack track`: a video, an image folder or stored detections become tracks."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from vidtrack.cli.options import announce_compiling, common, settings_options, smooth_option, start_log
from vidtrack.cli.tracking import chosen_settings, tracking_options


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
@tracking_options
@smooth_option
@click.option(
    "--link/--no-link",
    default=None,
    help="Join broken tracks and fill their gaps; rows appear at the end.  [default: of stored detections]",
)
@click.option("--fps", type=float, metavar="N", help="True frames/s, where the input carries no times or wrong ones.")
def command(
    source: str,
    output: Path | None,
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
    tracks.png. Ctrl-C ends with complete results up to then.
    """
    from vidtrack.cli.progress import progress, tell_outcome
    from vidtrack.cli.signals import Terminated, stoppable
    from vidtrack.config import Input, load
    from vidtrack.run.files import run_file
    from vidtrack.run.run import Extras
    from vidtrack.video.detections import is_detections
    from vidtrack.video.recording import is_recording, recorded_settings

    start_log(verbose, quiet)
    base = recorded_settings(source) if is_recording(source) else None
    kind = Input.DETECTIONS if is_detections(source) else Input.VIDEO
    settings = load(config_file, [*assignments, *chosen_settings(chosen)], base, kind)
    announce_compiling(quiet)
    extras = Extras(rerun, video, save_masks, decisions)
    with run_file(source, settings, output, extras, force=force) as run:
        try:
            for _ in stoppable(progress(run, run.count, run.name, quiet)):
                pass  # the sinks have seen it
        except (KeyboardInterrupt, Terminated):
            click.echo(f"vidtrack: the results up to here are in {run.folder}", err=True)
            raise
    tell_outcome(run.folder, quiet, "no tracks; vidtrack doctor SOURCE may say why")
    click.echo(run.folder)
