"""`vidtrack fuse`: the tracks of several finished runs as one picture."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import click

from vidtrack.cli.options import Options, common, receives, start_log


@dataclass(frozen=True, kw_only=True)
class FuseOptions(Options):
    """Options of `vidtrack fuse`."""

    runs: tuple[Path, ...]


@click.command(
    name="fuse",
    epilog="""\b
Examples:
  vidtrack fuse runs/north runs/south
  vidtrack fuse runs/north runs/south runs/ship -o picture
  vidtrack fuse north south -o both && vidtrack view both""",
)
@click.argument("runs", nargs=-1, required=True, type=click.Path(path_type=Path))
@common("Folder for the results.  [default: runs/NAMES]")
@receives(FuseOptions)
def command(options: FuseOptions) -> None:
    """Fuse the tracks of the folders RUNS, made with `vidtrack radar` in the same coordinates, into one.

    Tracks of different runs whose paths agree within their errors are one target, with the state and the covariance
    of covariance intersection, which are right whatever the runs have in common. Where there are plots,
    `vidtrack radar` with --radars is more accurate. The results' folder is printed; it holds tracks.csv,
    tracks.parquet, summary.json and tracks.png.
    """
    from vidtrack.cli.tracking import finish
    from vidtrack.run.fuse import run_fusion

    start_log(options.verbose, options.quiet)
    if len(options.runs) < 2:
        raise click.UsageError("fuse needs two runs or more")
    finish(run_fusion(options.runs, options.output, force=options.force), options.quiet, unit="scan")
