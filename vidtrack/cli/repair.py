"""`vidtrack repair`: makes the folder of a killed run whole."""

from __future__ import annotations

from pathlib import Path

import click


@click.command(
    name="repair",
    short_help="Make the folder of a killed run whole.",
    epilog="""\b
Examples:
  vidtrack repair runs/motorway
  vidtrack repair /data/monday && vidtrack eval /data/monday gt.txt
  for run in runs/*; do vidtrack repair "$run"; done""",
)
@click.argument("folder", metavar="DIR", type=click.Path(path_type=Path))
@click.option("--quiet", is_flag=True, help="No report.")
def command(folder: Path, quiet: bool) -> None:
    """Rebuild tracks.parquet in DIR from tracks.csv, cut half-written lines, sort mot.txt and counts.csv.

    A killed run stays marked as interrupted in summary.json. A finished run is left as it is. Of a live run in
    parts, every part is repaired.
    """
    from vidtrack.live.keep import parts_of
    from vidtrack.output.repair import repair

    for part in parts_of(folder) or [folder]:
        rows = repair(part)
        if not quiet:
            click.echo(f"{part}: {rows} rows in tracks.csv and tracks.parquet", err=True)
