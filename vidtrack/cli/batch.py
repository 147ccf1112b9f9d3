"""`vidtrack batch`: many files on all cores, or on a Dask cluster."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import click

from vidtrack.cli.options import WithSettings, receives, settings_options, start_log


@dataclass(frozen=True, kw_only=True)
class BatchOptions(WithSettings):
    """Options of `vidtrack batch`; `output` may be an address."""

    output: str  # type: ignore[assignment]
    sources: tuple[str, ...]
    site: Path | None
    lines: tuple[str, ...]
    dask: str | None
    workers: int | None
    slice_s: float
    warm_s: float | None
    patience_s: float


@click.command(
    name="batch",
    epilog="""\b
Examples:
  vidtrack batch archive/ -o tracked
  vidtrack batch "cam1/*.mp4" "cam2/*.mp4" -o tracked --site site.toml --set output.level=tracks
  vidtrack batch sources.csv -o s3://bucket/tracked --dask tcp://scheduler:8786
  vidtrack measure tracked""",
)
@click.argument("sources", nargs=-1, required=True)
@click.option("-o", "--output", required=True, metavar="DIR|ADDRESS", help="Folder or address for all results.")
@click.option("--dask", metavar="local|tcp://HOST:PORT|FILE.json", help="Use a Dask cluster.  [default: this machine]")
@click.option(
    "--workers", type=click.IntRange(min=1), metavar="N", help="Cores of this machine to use.  [default: all]"
)
@click.option(
    "--site",
    type=click.Path(path_type=Path),
    metavar="SITE.toml",
    help="Add positions in metres and speeds, by this site's calibration.",
)
@click.option("--line", "lines", multiple=True, metavar="NAME:x1,y1,x2,y2", help="Count over a line; repeat for more.")
@click.option(
    "--slice",
    "slice_s",
    type=click.FloatRange(min=0),
    default=3600.0,
    show_default=True,
    metavar="S",
    help="Cut files that are much longer than this [s]; 0: never.",
)
@click.option(
    "--warm-up",
    "warm_s",
    type=click.FloatRange(min=0),
    metavar="S",
    help="Do a file's slices at the same time, each from so much before its beginning [s]; results then differ a "
    "little from a single run's.  [default: one after the other, exactly as one run]",
)
@click.option(
    "--patience",
    "patience_s",
    type=click.FloatRange(min=1),
    default=300.0,
    show_default=True,
    metavar="S",
    help="Kill a process that gives no frame for so long [s].",
)
@settings_options
@click.option("--force", is_flag=True, help="Do everything again, also what is done.")
@click.option("-q", "--quiet", is_flag=True, help="Only errors: no progress, no warnings.")
@click.option("-v", "--verbose", count=True, help="Say more; twice: everything.")
@receives(BatchOptions)
def command(options: BatchOptions) -> None:
    """Track all SOURCES: files, folders, patterns, fsspec addresses, or a table (CSV, Parquet) with a column source.

    Each gets a folder in DIR/results, as `vidtrack track` writes it, and a row in DIR/index.parquet. The same command
    again does what is missing, failed or changed. A table may also have the columns site, start (a time with its zone)
    and settings (A.B=VALUE; A.B=VALUE).
    """
    from vidtrack.cli.batch_progress import telling
    from vidtrack.errors import SourceError, StoppedEarly
    from vidtrack.run.batch.batch import Batch
    from vidtrack.run.batch.engines import engine
    from vidtrack.run.batch.place import place_of
    from vidtrack.run.batch.plan import Plan
    from vidtrack.run.batch.sources import listed

    start_log(options.verbose, options.quiet)
    place = place_of(options.output)
    own_place = options.output if "://" in options.output else str(Path(options.output).absolute())
    plan = Plan(
        own_place, options.config_file, tuple(options.given()), options.slice_s, options.warm_s, options.patience_s
    )
    tasks = list(plan.tasks(listed(options.sources)))
    with place.held():
        batch = Batch(place, tasks, again=options.force)
        with engine(options.dask, options.workers) as found, telling(batch, found.shown, options.quiet) as tell:
            batch.run(found, tell)
    click.echo(place.shown)
    aside = sum(batch.rows[task.about["source"]].state != "done" for task in tasks)
    if not aside:
        return
    if batch.unreadable == len(tasks):
        raise SourceError(f"no source can be read; the reasons are in {place.shown}/index.parquet")
    raise StoppedEarly(f"{aside} of {len(tasks)} sources are set aside; the reasons are in {place.shown}/index.parquet")
