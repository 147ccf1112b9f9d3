"""`vidtrack reproduce`: figures and tables of the papers."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import click

from vidtrack.cli.options import Options, common, receives, seed_option, start_log


@dataclass(frozen=True, kw_only=True)
class ReproduceOptions(Options):
    """Options of `vidtrack reproduce`."""

    names: tuple[str, ...]
    seed: int
    listed: bool
    runs: int | None


@click.command(
    name="reproduce",
    epilog="""\b
Examples:
  vidtrack reproduce --list
  vidtrack reproduce 004-fig5 004-montecarlo
  vidtrack reproduce 004-montecarlo --runs 1000 --seed 7 -o table""",
)
@click.argument("names", nargs=-1, metavar="[NAME ...]")
@common("Folder for NAME.png and NAME.csv.  [default: reproduced]")
@seed_option
@click.option("--list", "listed", is_flag=True, help="Show the names and what each one is, and do nothing.")
@click.option("--runs", type=click.IntRange(min=1), metavar="N", help="Monte Carlo runs, or simulated videos.")
@receives(ReproduceOptions)
def command(options: ReproduceOptions) -> None:
    """Reproduce the papers' figures and tables, ours beside theirs; without a NAME all of them.

    Each writes NAME.png and NAME.csv and prints in one sentence what came out. 004-montecarlo writes them after every
    1000 crossings, so that what is done stays if it is stopped.
    """
    from vidtrack.cli.signals import Terminated
    from vidtrack.output.folder import open_folder
    from vidtrack.papers.registry import choose

    start_log(options.verbose, options.quiet)
    chosen = choose(options.names)
    if options.listed:
        width = max(map(len, chosen))
        for name, experiment in chosen.items():
            click.echo(f"{name:{width}}  {experiment.title}")
        return
    wanted, force = options.output or Path("reproduced"), options.force or options.output is None
    folder = open_folder(wanted, "reproduced", force)
    for name, experiment in chosen.items():
        if not options.quiet:
            click.echo(f"{name} ...", err=True)
        result = None
        try:
            for result in experiment.results(options.runs, options.seed):
                result.write(folder, name)  # at once: it is kept if the run is killed
        except (KeyboardInterrupt, Terminated):
            if result is not None:
                click.echo(f"vidtrack: {name} up to here is in {folder}, with the number of runs", err=True)
            raise
        if result is not None:
            click.echo(f"{name}: {result.verdict}")
