"""`vidtrack radar`: a table of radar plots becomes tracks."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from vidtrack.cli.options import (
    announce_compiling,
    association_options,
    common,
    seed_option,
    settings_options,
    smooth_option,
    start_log,
)

_SETTING = {
    "method": "tracker.method",
    "distance": "tracker.distance",
    "estimator": "radar.estimator",
    "model": "radar.model",
    "skip_bad_rows": "radar.skip_bad_rows",
    "smooth": "output.smooth",
}


@click.command(
    name="radar",
    short_help="Tracks from a table of radar plots.",
    epilog="""\b
Examples:
  vidtrack radar plots.csv
  vidtrack radar plots.parquet -o result --estimator ekf --set radar.max_speed=60
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
    type=click.Choice(["kalman", "converted", "ekf", "ukf", "imm", "alpha-beta", "particle"]),
    help="Filter of each track.  [default: kalman]",
)
@click.option("--model", type=click.Choice(["cv", "ca", "singer", "ct"]), help="How targets move.  [default: cv]")
@click.option(
    "--skip-bad-rows", is_flag=True, default=None, help="Leave out rows that cannot be right, and count them."
)
def command(
    plots: str,
    output: Path | None,
    seed: int,
    force: bool,
    quiet: bool,
    verbose: int,
    config_file: Path | None,
    assignments: tuple[str, ...],
    rerun: str | None,
    decisions: bool,
    **chosen: Any,
) -> None:
    """Track the targets in PLOTS, a CSV or Parquet table with one row per plot.

    Columns: scan, time_s, and range_m, azimuth_deg[, elevation_deg] or x_m, y_m[, z_m]; optional: doppler_m_s,
    amplitude, and sigma_range_m, sigma_azimuth_deg, ... for the errors. Azimuth is clockwise from north, x east,
    y north, z up. The results' folder is printed; it holds tracks.csv, tracks.parquet, summary.json and tracks.png.
    Ctrl-C ends with complete results up to then.
    """
    from vidtrack.cli.progress import progress, tell_outcome
    from vidtrack.cli.signals import Terminated, stoppable
    from vidtrack.config import Input, load
    from vidtrack.run.radar import run_plots
    from vidtrack.run.run import Extras

    start_log(verbose, quiet)
    given = [(_SETTING[name], value) for name, value in chosen.items() if value is not None]
    settings = load(config_file, [*assignments, *given], kind=Input.RADAR)
    announce_compiling(quiet)
    extras = Extras(rerun=rerun, decisions=decisions)
    with run_plots(plots, settings, output, extras, force=force, seed=seed) as run:
        try:
            for _ in stoppable(progress(run, run.count, run.name, quiet, unit="scan")):
                pass  # the sinks have seen it
        except (KeyboardInterrupt, Terminated):
            click.echo(f"vidtrack: the results up to here are in {run.folder}", err=True)
            raise
    tell_outcome(run.folder, quiet)
    click.echo(run.folder)
