"""`vidtrack export`: the tracks of a finished run in the formats of other programs."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import click

from vidtrack.cli.options import Options, common, radar_position_option, receives, start_log
from vidtrack.output.export.registry import FORMATS


@dataclass(frozen=True, kw_only=True)
class ExportOptions(Options):
    """What `vidtrack export` is told."""

    run: Path
    form: str
    site: Path | None
    radar_position: tuple[float, float, float] | None


_HELP = f"""Write the tracks of the folder RUN, made with `vidtrack track --site`, in a format of other programs.

Rows outside the calibrated part of the picture have no position and are left out. For utdf, RUN is a folder that
`vidtrack measure` wrote; for asterix, one that `vidtrack radar` wrote.

\b
{chr(10).join(f"{name:10}  {form.writes}" for name, form in FORMATS.items())}
"""


@click.command(
    name="export",
    help=_HELP,
    epilog="""\b
Examples:
  vidtrack export runs/motorway --as geojson
  vidtrack export runs/motorway --as sumo -o fcd
  vidtrack export runs/motorway --as ssam --site site.toml
  vidtrack export monday --as utdf
  vidtrack export runs/tws --as asterix --radar-position 52.36,13.51,48""",
)
@click.argument("run", type=click.Path(path_type=Path))
@common("Folder to write.  [default: runs/RUN-FORMAT]")
@click.option("--as", "form", type=click.Choice(list(FORMATS)), required=True, help="The format.")
@click.option("--site", type=click.Path(path_type=Path), metavar="SITE.toml", help="[default: the site of the run]")
@radar_position_option("asterix: x = y = 0 of the run in WGS84, degrees and metres.  [default: as the run knows it]")
@receives(ExportOptions)
def command(options: ExportOptions) -> None:
    """Export a run."""
    from contextlib import suppress

    from vidtrack.errors import ConfigError, Error
    from vidtrack.output.export.radar_run import RadarRun, open_radar_run
    from vidtrack.output.export.registry import export
    from vidtrack.output.export.road_run import RoadRun, open_road_run
    from vidtrack.output.folder import open_folder, refuse_overwriting
    from vidtrack.traffic.report.findings import Findings, read_findings

    start_log(options.verbose, options.quiet)
    run: RoadRun | RadarRun | Findings
    form = FORMATS[options.form]
    if options.radar_position is not None and not form.radar:
        raise ConfigError(f"--radar-position is for asterix; {options.form} has the positions of a site")
    if form.radar:
        if options.site is not None:
            raise ConfigError(f"{options.form} is for radar runs, which have no site; leave --site out")
        run = open_radar_run(options.run, options.radar_position)
    elif form.measures:
        if options.site is not None:
            raise ConfigError(f"{options.form} takes the site that was measured at; measure again with another --site")
        run = read_findings(options.run)
    else:
        run = open_road_run(options.run, options.site)
    refuse_overwriting(options.run, options.output)
    folder = open_folder(options.output, f"{options.run.resolve().name}-{options.form}", options.force)
    try:
        said = export(run, options.form, folder)
    except Error:
        with suppress(OSError):
            folder.rmdir()  # if nothing else is in it
        raise
    if not options.quiet:
        if isinstance(run, RoadRun):
            tracks = f"{len(run.vehicles.track)} track{'s' if len(run.vehicles.track) > 1 else ''}"
            said = f"{tracks}; {run.positions} of {run.rows} rows have a position in metres"
        click.echo(said if isinstance(run, RadarRun) else f"site {run.site.camera.name}; {said}", err=True)
    click.echo(folder)
