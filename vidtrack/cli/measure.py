"""`vidtrack measure`: traffic figures from finished runs."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import click

from vidtrack.cli.json_file import json_option
from vidtrack.cli.options import Options, common, receives, start_log


@dataclass(frozen=True, kw_only=True)
class MeasureOptions(Options):
    """What `vidtrack measure` is told."""

    runs: tuple[str, ...]
    site: Path | None
    json_to: str | None


@click.command(
    name="measure",
    epilog="""\b
Examples:
  vidtrack measure runs/traffic
  vidtrack measure runs/traffic --site moved-gates.toml
  vidtrack measure hour-07 hour-08 hour-09 --site site.toml -o monday
  vidtrack measure tracked
  vidtrack measure cam1@2026-06-01T07:00:00+02:00 --site site.toml --json -""",
)
@click.argument("runs", metavar="RUN...", nargs=-1, required=True)
@click.option(
    "--site",
    type=click.Path(path_type=Path),
    metavar="SITE.toml",
    help="Gates and calibration.  [default: the site that the runs were tracked with, as it was then]",
)
@common("Folder for the tables.  [default: runs/SITE, or runs/RUN-measures without --site]")
@json_option
@receives(MeasureOptions)
def command(options: MeasureOptions) -> None:
    """Crossings, trips, intervals, stays, queues, conflicts and checks from finished runs, without tracking again.

    All RUNs are of one site and one day: files of hours, or a live run with its parts. RUN@TIME gives the time of a
    run's first picture; without it a live run knows its own, and a file goes on where the one before it ended.
    A single RUN may be the folder or address of a batch: then each site and day is measured by itself.
    """
    from vidtrack.cli.archive import measure_archive
    from vidtrack.cli.json_file import write_json
    from vidtrack.errors import ConfigError
    from vidtrack.output.figures import write_figures
    from vidtrack.output.folder import open_folder, refuse_overwriting, replacing
    from vidtrack.recording.retention import parts_of
    from vidtrack.run.batch.archive import is_archive
    from vidtrack.traffic.measures.doubts import against
    from vidtrack.traffic.measures.measure import measured
    from vidtrack.traffic.measures.runs import folder_of, parts_with_tracks, site_of
    from vidtrack.traffic.site import read_site

    start_log(options.verbose, options.quiet)
    if len(options.runs) == 1 and is_archive(options.runs[0]):
        if options.json_to is not None:
            raise ConfigError("--json is for one day; those of a batch are in days/SITE/DAY/measures.json")
        refuse_overwriting(Path(options.runs[0]), options.output)
        click.echo(measure_archive(options.runs[0], options.site, options.output, options.force, options.quiet))
        return
    runs = []
    for run in options.runs:
        parts = parts_with_tracks(Path(run), parts_of(Path(run)))
        for read in (folder_of(run), *parts):
            refuse_overwriting(read, options.output)
        runs += [str(part) for part in parts] or [run]
    source = site_of(runs, options.site)
    site, text = read_site(source), source.read_bytes()
    found = measured(runs, site)
    first = folder_of(options.runs[0]).resolve()
    name = f"{first.name}-measures" if options.site is None else options.site.stem
    folder = open_folder(options.output, name, options.force)
    write_figures(folder, found.tables, found.report)
    if found.report["conflicts"] is None:
        for name in ("conflicts.csv", "conflicts.parquet"):  # of an earlier measurement, with a calibration
            (folder / name).unlink(missing_ok=True)
    with replacing(folder / "site.toml") as new:  # the report draws its gates
        new.write_bytes(text)
    if options.json_to is not None:
        write_json(found.report, options.json_to)
    if not options.quiet:
        click.echo(_told(found.report, None if site.gates else len(found.tables["stays"])), err=True)
        for doubt in against(found.report):
            click.echo(f"vidtrack: {doubt}", err=True)
    if options.json_to != "-":
        click.echo(folder)


def _told(report: dict[str, Any], stays: int | None) -> str:
    """One line: what was found. `stays`: at a site without gates."""
    wrong = sum(movement["trips"] for movement in report["impossible_movements"])
    conflicts = report["conflicts"]
    close = "no conflicts without a calibration" if conflicts is None else f"{conflicts} conflicts"
    watched = f"vidtrack: watched {report['watched_s']:.0f} s"
    if stays is not None:
        return f"{watched}: {stays} stays in zones; no crossings, trips and queues without gates; {close}"
    return (
        f"{watched}: {report['crossings']} crossings, "
        f"{report['complete_trips']} whole trips of {report['trips']}, {report['joins']} broken tracks joined; "
        f"{wrong} trips over impossible movements, {report['appeared']} vehicles appeared between the gates, "
        f"{report['vanished']} vanished; {close}"
    )
