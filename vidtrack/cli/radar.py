"""`vidtrack radar`: tracks a table of radar plots."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import click

from vidtrack.cli.options import announce_compiling, common, receives, seed_option, settings_options, start_log
from vidtrack.cli.tracking import TrackingOptions, association_options, choice, finish, smooth_option
from vidtrack.config import names


@dataclass(frozen=True, kw_only=True)
class RadarOptions(TrackingOptions):
    """Options of `vidtrack radar`."""

    plots: tuple[str, ...]
    radars: Path | None
    seed: int
    smooth: bool | None
    estimator: str | None
    model: str | None
    skip_bad_rows: bool | None


@click.command(
    name="radar",
    epilog="""\b
Examples:
  vidtrack radar plots.csv
  vidtrack radar plots.parquet -o result --estimator ekf --set radar.max_speed=60
  vidtrack radar north.csv south.csv --radars radars.toml -o picture
  vidtrack simulate radar-tws -o tws && vidtrack radar tws/plots.csv -o run && vidtrack eval run tws/truth.csv""",
)
@click.argument("plots", nargs=-1, required=True)
@common("Folder for the results.  [default: runs/NAME]")
@seed_option
@settings_options
@association_options
@smooth_option
@click.option(
    "--radars",
    type=click.Path(path_type=Path),
    metavar="RADARS.toml",
    help="Places and errors of the radars; NAME.csv has the plots of radar NAME.",
)
@click.option(
    "--estimator",
    type=choice(names.Estimator),
    help="Filter of each track.  [default: imm]",
)
@click.option("--model", type=choice(names.Model), help="How targets move.  [default: ct for imm, else cv]")
@click.option(
    "--skip-bad-rows", is_flag=True, default=None, help="Leave out rows that cannot be right, and count them."
)
@receives(RadarOptions)
def command(options: RadarOptions) -> None:
    """Track the targets in PLOTS, a CSV or Parquet table with one row per plot; of several radars one table each.

    Columns: scan, time_s, and range_m, azimuth_deg[, elevation_deg] or x_m, y_m[, z_m]; optional: doppler_m_s,
    amplitude, and sigma_range_m, sigma_azimuth_deg, ... for the errors. Azimuth is clockwise from north, x east,
    y north, z up. Tables of several radars become one picture: --radars says where they are; their biases in range,
    azimuth and time are estimated from common targets (registration.csv). The results' folder is printed; it holds
    tracks.csv, tracks.parquet, summary.json and tracks.png.
    Ctrl-C ends with complete results up to then.
    """
    from vidtrack.config.inputs import Input
    from vidtrack.run.network import run_network
    from vidtrack.run.radar import run_plots
    from vidtrack.run.run import Extras

    start_log(options.verbose, options.quiet)
    settings = options.settings(Input.RADAR)
    announce_compiling(options.quiet)
    extras = Extras(rerun=options.rerun, decisions=options.decisions)
    where = {"output": options.output, "extras": extras, "force": options.force, "seed": options.seed}
    if options.radars is not None:
        run = run_network(options.plots, options.radars, settings, **where)
    elif len(options.plots) > 1:
        raise click.UsageError(f"{len(options.plots)} tables of plots need --radars, which says where the radars are")
    else:
        run = run_plots(options.plots[0], settings, **where)
    finish(run, options.quiet, unit="scan")
