"""`vidtrack radar`: tracks radar plots, from a table, a recording or the network."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import click

from vidtrack.cli.options import (
    announce_compiling,
    common,
    radar_position_option,
    receives,
    seed_option,
    settings_options,
    start_log,
)
from vidtrack.cli.tracking import TrackingOptions, association_options, choice, finish, finish_feed, smooth_option
from vidtrack.config import names

if TYPE_CHECKING:
    from vidtrack.run.run import Extras, Run


@dataclass(frozen=True, kw_only=True)
class RadarOptions(TrackingOptions):
    """Options of `vidtrack radar`."""

    plots: tuple[str, ...]
    radars: Path | None
    camera: str | None
    site: Path | None
    seed: int
    smooth: bool | None
    estimator: str | None
    model: str | None
    snr_db: float | None
    group: float | None
    skip_bad_rows: bool | None
    radar_position: tuple[float, float, float] | None


@click.command(
    name="radar",
    epilog="""\b
Examples:
  vidtrack radar plots.csv
  vidtrack radar plots.parquet -o result --estimator ekf --set radar.max_speed=60
  vidtrack radar recording.pcap --set radar.sac=25 --set radar.sic=201 --radar-position 45.74,16.07,105
  vidtrack radar udp://239.1.2.3:8600 -o live
  vidtrack radar north.csv south.csv --radars radars.toml -o picture
  vidtrack radar plots.csv --method pda --snr-db 13 --set radar.cell_range_m=150 --set radar.cell_azimuth_deg=1.5
  vidtrack radar formation.csv --group 300
  vidtrack radar radar.csv --radars radars.toml --camera traffic.mp4 --site site.toml
  vidtrack simulate radar-tws -o tws && vidtrack radar tws/plots.csv -o run && vidtrack eval run tws/truth.csv""",
)
@click.argument("plots", nargs=-1, required=True)
@common("Folder for the results.  [default: runs/NAME]")
@seed_option
@settings_options
@association_options
@smooth_option("no-smooth")
@click.option(
    "--radars",
    type=click.Path(path_type=Path),
    metavar="RADARS.toml",
    help="Places and errors of the radars; NAME.csv or NAME.ast has the plots of radar NAME.",
)
@click.option("--camera", metavar="VIDEO", help="A video of the same road and time, to be tracked with the plots.")
@click.option(
    "--site",
    type=click.Path(path_type=Path),
    metavar="SITE.toml",
    help="Calibration of the camera, in the metres of the radars' places.",
)
@click.option(
    "--estimator",
    type=choice(names.Estimator),
    help="Filter of each track.  [default: imm]",
)
@click.option("--model", type=choice(names.Model), help="How targets move.  [default: ct for imm, else cv]")
@click.option(
    "--snr-db",
    type=float,
    metavar="DB",
    help="Each track sets its own detection threshold, the best for targets of this SNR; plots need amplitudes.",
)
@click.option("--group", type=float, metavar="M", help="Track groups: plots at most so many metres apart are one.")
@click.option(
    "--skip-bad-rows", is_flag=True, default=None, help="Leave out rows that cannot be right, and count them."
)
@radar_position_option("Place of x = y = 0 in WGS84, degrees and metres: for positions in degrees, and for CAT 062.")
@receives(RadarOptions)
def command(options: RadarOptions) -> None:
    """Track the targets in PLOTS: a table, a recording, or udp://ADDRESS:PORT; of several radars one table each.

    A recording is ASTERIX (raw, pcap, FINAL) or NMEA with TTM, TLL or AIS, which its content tells; at an address they
    are tracked until Ctrl-C. A table is CSV or Parquet with one row per plot.

    Columns: scan, time_s, and range_m, azimuth_deg[, elevation_deg] or x_m, y_m[, z_m]; optional: doppler_m_s,
    amplitude, and sigma_range_m, sigma_azimuth_deg, ... for the errors. Azimuth is clockwise from north, x east,
    y north, z up. Tables of several radars become one picture: --radars says where they are; their biases in range,
    azimuth and time are estimated from common targets (registration.csv). With --camera and --site the plots of a
    traffic radar and the blobs of a video give tracks of vehicles, in metres. The results' folder is printed; it holds
    tracks.csv, tracks.parquet, summary.json and tracks.png.
    Ctrl-C ends with complete results up to then.
    """
    from threading import Event

    from vidtrack.config.inputs import Input
    from vidtrack.radar.feeds.udp import is_address
    from vidtrack.rehearsal import rehearse_beside
    from vidtrack.run.network import run_network
    from vidtrack.run.radar import first_plots, run_plots
    from vidtrack.run.radar_live import run_feed
    from vidtrack.run.run import Extras

    start_log(options.verbose, options.quiet)
    extras = Extras(rerun=options.rerun, decisions=options.decisions)
    if options.camera is not None or options.site is not None:
        finish(_with_camera(options, extras), options.quiet, unit="scan")
        return
    settings = options.settings(Input.RADAR)
    announce_compiling(options.quiet, video=False)
    first, output, force, seed = options.plots[0], options.output, options.force, options.seed
    if is_address(first) and len(options.plots) == 1 and options.radars is None:
        stop = Event()
        feed = run_feed(first, settings, stop.is_set, output, extras, force=force, seed=seed)
        if not options.quiet:
            click.echo(f"vidtrack: listening at {first} until Ctrl-C", err=True)
        finish_feed(feed, stop.set, options.quiet)
        return
    if options.radars is not None:
        run = run_network(options.plots, options.radars, settings, output, extras, force=force, seed=seed)
    elif len(options.plots) > 1:
        raise click.UsageError(f"{len(options.plots)} tables of plots need --radars, which says where the radars are")
    else:
        rehearse_beside(first_plots, first, settings)
        run = run_plots(first, settings, output, extras, force=force, seed=seed)
    finish(run, options.quiet, unit="scan")


def _with_camera(options: RadarOptions, extras: Extras) -> Run:
    """The run of a radar and a camera."""
    from vidtrack.run.road import ROAD, run_road

    if options.radars is None or options.camera is None or options.site is None:
        raise click.UsageError("a camera beside a radar needs --radars, --camera and --site")
    settings = options.settings(base=ROAD)
    announce_compiling(options.quiet)
    return run_road(
        options.plots, options.radars, options.camera, options.site, settings, options.output, extras,
        force=options.force, seed=options.seed,
    )  # fmt: skip
