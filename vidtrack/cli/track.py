"""`vidtrack track`: tracks a video, an image folder or stored detections."""

from __future__ import annotations

from dataclasses import dataclass

import click

from vidtrack.cli.options import announce_compiling, common, receives, settings_options, start_log
from vidtrack.cli.tracking import PictureOptions, finish, picture_options, smooth_option


@dataclass(frozen=True, kw_only=True)
class TrackOptions(PictureOptions):
    """Options of `vidtrack track`."""

    source: str
    smooth: bool | None
    link: bool | None
    fps: float | None


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
@picture_options
@smooth_option("of stored detections")
@click.option(
    "--link/--no-link",
    default=None,
    help="Join broken tracks and fill their gaps; rows appear at the end.  [default: of stored detections]",
)
@click.option("--fps", type=float, metavar="N", help="True frames/s, where the input carries no times or wrong ones.")
@receives(TrackOptions)
def command(options: TrackOptions) -> None:
    """Track the vehicles in SOURCE: a video file, an image folder or glob, or a MOT det.txt.

    The results' folder is printed. It holds tracks.csv, tracks.parquet, mot.txt, summary.json and
    tracks.png. Ctrl-C ends with complete results up to then.
    """
    from vidtrack.config.inputs import Input
    from vidtrack.recording.source import recorded_settings
    from vidtrack.rehearsal import rehearse_beside
    from vidtrack.run.boxes import first_boxes
    from vidtrack.run.files import kind_of_file, run_file
    from vidtrack.run.run import Extras

    start_log(options.verbose, options.quiet)
    source = options.source
    kind = kind_of_file(source)
    stored = kind is Input.DETECTIONS
    settings = options.settings(kind, recorded_settings(source) if kind is Input.RECORDING else None)
    announce_compiling(options.quiet, video=not stored)
    if stored:
        rehearse_beside(first_boxes, source, settings)
    extras = Extras(options.rerun, options.video, options.save_masks, options.decisions)
    run = run_file(source, settings, options.output, extras, force=options.force)
    finish(run, options.quiet, none="no tracks; vidtrack doctor SOURCE may say why")
