"""`vidtrack report`: what was measured at a site, as one hands it out."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import click

from vidtrack.cli.options import Options, common, receives, start_log


@dataclass(frozen=True, kw_only=True)
class ReportOptions(Options):
    """What `vidtrack report` is told."""

    measures: Path
    picture: str | None


@click.command(
    name="report",
    epilog="""\b
Examples:
  vidtrack report runs/site
  vidtrack report monday -o monday-report --picture traffic.mp4
  vidtrack report monday --picture empty-road.png""",
)
@click.argument("measures", type=click.Path(path_type=Path))
@common("Folder for the report.  [default: runs/MEASURES-report]")
@click.option(
    "--picture",
    metavar="IMAGE|VIDEO",
    help="Draw the arrows over this, or its first picture.  [default: the runs' scene]",
)
@receives(ReportOptions)
def command(options: ReportOptions) -> None:
    """Turning movements, peak hour, speeds, queues and checks of MEASURES, a folder that `vidtrack measure` wrote.

    MEASURES may be the folder of a batch that was measured: then each site and day gets a report.

    Writes report.html, one file that needs nothing else, and its pictures and tables as PNG and CSV.
    """
    from vidtrack.cli.archive import measured_days, report_archive
    from vidtrack.cli.calibrate import first_picture
    from vidtrack.errors import ConfigError
    from vidtrack.output.corrections import reviewed
    from vidtrack.output.folder import open_folder, refuse_overwriting
    from vidtrack.output.report.report import write_report
    from vidtrack.traffic.report.findings import read_findings

    start_log(options.verbose, options.quiet)
    days = measured_days(options.measures)
    if days is not None:
        if options.picture is not None:
            raise ConfigError("--picture is for one day: give its folder, below days")
        click.echo(report_archive(days, options.output, options.force, options.quiet))
        return
    found, by_hand = read_findings(options.measures), reviewed(options.measures)
    refuse_overwriting(options.measures, options.output)
    scene = None if options.picture is None else first_picture(options.picture)
    if scene is not None:
        found.site.scaled(scene.shape[1], scene.shape[0])  # refuses a picture of another shape
    folder = open_folder(options.output, f"{options.measures.resolve().name}-report", options.force)
    write_report(folder, found, scene, by_hand)
    click.echo(folder)
