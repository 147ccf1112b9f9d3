"""`vidtrack repair`: repairs the folder of a killed run."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import click

from vidtrack.cli.options import Options, common, receives, start_log


@dataclass(frozen=True, kw_only=True)
class RepairOptions(Options):
    """Options of `vidtrack repair`."""

    source: Path


@click.command(
    name="repair",
    epilog="""\b
Examples:
  vidtrack repair runs/motorway
  vidtrack repair /data/monday && vidtrack eval /data/monday gt.txt
  for run in runs/*; do vidtrack repair "$run"; done""",
)
@click.argument("source", metavar="DIR", type=click.Path(path_type=Path))
@common("Repair a copy in this folder and leave DIR as it is.  [default: DIR itself]")
@receives(RepairOptions)
def command(options: RepairOptions) -> None:
    """Rebuild tracks.parquet in DIR from tracks.csv, cut half-written lines, sort mot.txt and counts.csv.

    A killed run stays marked as interrupted in summary.json. A finished run is left as it is. Of a live run in
    parts, every part is repaired.
    """
    from shutil import Error, copytree

    from vidtrack.errors import StoppedEarly
    from vidtrack.output.folder import open_run, refuse_overwriting
    from vidtrack.output.repair import has_tracks, repair
    from vidtrack.recording.retention import parts_of

    start_log(options.verbose, options.quiet)
    folder = options.source
    if options.output is not None and folder.is_dir():
        refuse_overwriting(folder, options.output)
        copy = open_run(options.output, "repair", options.force)
        try:
            copytree(folder, copy, dirs_exist_ok=True)
        except Error as error:  # lists all files that could not be copied
            raise StoppedEarly(f"cannot copy {folder} to {copy}: {error.args[0][0][-1]}") from None
        folder = copy
    parts = parts_of(folder) or [folder]
    for part in [part for part in parts if part == folder or has_tracks(part)]:  # others have only counts left
        rows = repair(part)
        if not options.quiet:
            click.echo(f"{part}: {rows} rows of tracks", err=True)
