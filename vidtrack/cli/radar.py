"""`vidtrack radar`: tracks radar plots, from a table, a recording or the network."""

from __future__ import annotations

from dataclasses import dataclass

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


@dataclass(frozen=True, kw_only=True)
class RadarOptions(TrackingOptions):
    """Options of `vidtrack radar`."""

    plots: str
    seed: int
    smooth: bool | None
    estimator: str | None
    model: str | None
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
  vidtrack simulate radar-tws -o tws && vidtrack radar tws/plots.csv -o run && vidtrack eval run tws/truth.csv""",
)
@click.argument("plots")
@common("Folder for the results.  [default: runs/NAME]")
@seed_option
@settings_options
@association_options
@smooth_option
@click.option(
    "--estimator",
    type=choice(names.Estimator),
    help="Filter of each track.  [default: imm]",
)
@click.option("--model", type=choice(names.Model), help="How targets move.  [default: ct for imm, else cv]")
@click.option(
    "--skip-bad-rows", is_flag=True, default=None, help="Leave out rows that cannot be right, and count them."
)
@radar_position_option("Place of x = y = 0 in WGS84, degrees and metres: for positions in degrees, and for CAT 062.")
@receives(RadarOptions)
def command(options: RadarOptions) -> None:
    """Track the targets in PLOTS: a table, a recording, or udp://ADDRESS:PORT.

    A recording is ASTERIX (raw, pcap, FINAL) or NMEA with TTM, TLL or AIS, which its content tells; at an address they
    are tracked until Ctrl-C. A table is CSV or Parquet with one row per plot.

    Columns: scan, time_s, and range_m, azimuth_deg[, elevation_deg] or x_m, y_m[, z_m]; optional: doppler_m_s,
    amplitude, and sigma_range_m, sigma_azimuth_deg, ... for the errors. Azimuth is clockwise from north, x east,
    y north, z up. The results' folder is printed; it holds tracks.csv, tracks.parquet, summary.json and tracks.png.
    Ctrl-C ends with complete results up to then.
    """
    from threading import Event

    from vidtrack.config.inputs import Input
    from vidtrack.radar.feeds.udp import is_address
    from vidtrack.run.radar import run_plots
    from vidtrack.run.radar_live import run_feed
    from vidtrack.run.run import Extras

    start_log(options.verbose, options.quiet)
    settings = options.settings(Input.RADAR)
    announce_compiling(options.quiet)
    extras = Extras(rerun=options.rerun, decisions=options.decisions)
    if is_address(options.plots):
        stop = Event()
        feed = run_feed(
            options.plots, settings, stop.is_set, options.output, extras, force=options.force, seed=options.seed
        )
        if not options.quiet:
            click.echo(f"vidtrack: listening at {options.plots} until Ctrl-C", err=True)
        finish_feed(feed, stop.set, options.quiet)
        return
    run = run_plots(options.plots, settings, options.output, extras, force=options.force, seed=options.seed)
    finish(run, options.quiet, unit="scan")
