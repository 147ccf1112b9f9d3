"""`vidtrack reproduce`: figures and tables of the papers."""

from __future__ import annotations

from pathlib import Path

import click

from vidtrack.cli.options import common, seed_option, start_log


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
def command(
    names: tuple[str, ...],
    output: Path | None,
    seed: int,
    force: bool,
    quiet: bool,
    verbose: int,
    listed: bool,
    runs: int | None,
) -> None:
    """Reproduce the papers' figures and tables, ours beside theirs; without a NAME all of them.

    Each writes NAME.png and NAME.csv and prints in one sentence what came out.
    """
    from vidtrack.output.folder import open_folder
    from vidtrack.papers.registry import choose

    start_log(verbose, quiet)
    chosen = choose(names)
    if listed:
        width = max(map(len, chosen))
        for name, experiment in chosen.items():
            click.echo(f"{name:{width}}  {experiment.title}")
        return
    folder = open_folder(output or Path("reproduced"), "reproduced", force or output is None)
    for name, experiment in chosen.items():
        if not quiet:
            click.echo(f"{name} ...", err=True)
        result = experiment.reproduce(runs, seed)
        result.write(folder, name)
        click.echo(f"{name}: {result.verdict}")
