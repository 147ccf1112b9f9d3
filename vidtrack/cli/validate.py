"""`vidtrack validate`: counted crossings against a count by hand."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import click

from vidtrack.cli.json_file import deliver, json_option
from vidtrack.cli.options import Options, common, receives, start_log

if TYPE_CHECKING:
    from vidtrack.traffic.validation.audit import Reviewed
    from vidtrack.traffic.validation.validate import Estimate, Validation

_TOLERANCE_S = 1.0


@dataclass(frozen=True, kw_only=True)
class ValidateOptions(Options):
    """What `vidtrack validate` is told."""

    measures: Path
    manual: Path | None
    tolerance: float | None
    start: str | None
    end: str | None
    json_to: str | None


@click.command(
    name="validate",
    epilog="""\b
Examples:
  vidtrack validate runs/motorway manual.csv
  vidtrack validate measures manual.csv --tolerance 2 --json -
  vidtrack validate measures manual.csv --start 0 --end 900
  vidtrack validate measures""",
)
@click.argument("measures", type=click.Path(path_type=Path))
@click.argument("manual", required=False, type=click.Path(path_type=Path))
@common("Folder for validation.json.  [default: only printed]")
@json_option
@click.option(
    "--tolerance",
    type=click.FloatRange(min=0, min_open=True),
    metavar="S",
    help="Largest difference in time of a hit.  [default: 1.0]",
)
@click.option("--start", metavar="TIME", help="Begin of the count by hand.  [default: its first crossing]")
@click.option("--end", metavar="TIME", help="Its end.  [default: its last crossing]")
@receives(ValidateOptions)
def command(options: ValidateOptions) -> None:
    """Compare crossings.csv (or a run's counts.csv) in the folder MEASURES with MANUAL, a CSV table of a count by hand.

    MANUAL has the columns time_s (seconds of the video) or utc (with a zone), gate (or line), direction, and perhaps
    certain (0: may be counted or not). Crossings are matched one to one, within gate, direction and tolerance.

    Without MANUAL the verdicts of vidtrack review about MEASURES tell the precision.
    """
    start_log(options.verbose, options.quiet)
    if options.manual is None:
        _by_review(options)
    else:
        _by_hand(options, options.manual)


def _by_hand(options: ValidateOptions, manual: Path) -> None:
    from vidtrack.traffic.validation.event_tables import clocks_of, read_counted, read_manual, seconds, table_of
    from vidtrack.traffic.validation.validate import validate

    path = table_of(options.measures)
    noted = read_manual(manual, clocks_of(path))
    counted = read_counted(options.measures, path, noted.clock)
    counted.check(noted, manual)
    begin, end = (
        None if text is None else seconds(text, noted.clock, name)
        for name, text in (("--start", options.start), ("--end", options.end))
    )
    result = validate(
        counted.events, noted, _TOLERANCE_S if options.tolerance is None else options.tolerance, begin, end
    )
    folder = options.folder("validate")
    if deliver(result.as_dict(), options.json_to, folder and folder / "validation.json", options.quiet):
        _print(result)


def _by_review(options: ValidateOptions) -> None:
    from vidtrack.errors import ConfigError
    from vidtrack.output.corrections import NAME, reviewed
    from vidtrack.traffic.validation.event_tables import table_of

    for name, value in (("--tolerance", options.tolerance), ("--start", options.start), ("--end", options.end)):
        if value is not None:
            raise ConfigError(f"{name} is for a count by hand; give MANUAL.csv, or leave it out")
    table_of(options.measures)  # refuses a folder without counts
    result = reviewed(options.measures)
    if result is None:
        raise ConfigError(
            f"{options.measures} has no {NAME}; give a count by hand, MANUAL.csv, or look at the crossings with "
            f"vidtrack review {options.measures} --sample 100"
        )
    folder = options.folder("validate")
    if deliver(result.as_dict(), options.json_to, folder and folder / "validation.json", options.quiet):
        _print_review(result)


def _print_review(result: Reviewed) -> None:
    from rich.console import Console
    from rich.table import Table

    console = Console()
    table = Table("gate", "figure", "value", "95 % from", "to")
    for column in table.columns[2:]:
        column.justify = "right"
    for name, row in result.rows:
        table.add_row(name, "counted", str(row.counted))
        for what, number in (("looked at", row.looked_at), ("false", row.false), ("missed", row.missed)):
            table.add_row("", what, str(number))
        table.add_row("", "corrected count", str(row.corrected))
        table.add_row("", f"precision %, of {row.sample} at random", *_cells(row.precision, 100, 1))
        table.add_section()
    console.print(table)
    console.print(
        "The precision is of the crossings that were looked at in random order from the first one on (vidtrack review "
        "--sample N). Doubtful ones that were looked at first are not in it. A recall needs a count by hand: what was "
        "noted as missed is only what somebody saw."
    )
    if result.homeless:
        console.print(f"{result.homeless} corrections are of crossings that are no longer there.")


def _print(result: Validation) -> None:
    from rich.console import Console
    from rich.table import Table

    from vidtrack.traffic.validation.event_tables import written

    console = Console()
    table = Table("gate", "figure", "value", "95 % from", "to")
    for column in table.columns[2:]:
        column.justify = "right"
    for name, row in [*result.gates.items(), ("all", result.pooled)]:
        table.add_row(name, "noted by hand", str(row.noted))
        for what, number in (("hit", row.hit), ("missed", row.missed), ("false", row.false)):
            table.add_row("", what, str(number))
        table.add_row("", "recall %", *_cells(row.recall, 100, 1))
        table.add_row("", "precision %", *_cells(row.precision, 100, 1))
        table.add_row("", "net bias %", *_cells(row.bias, 100, 1))
        table.add_row("", "GEH of hourly flows", *_cells(row.geh, 1, 2))
        table.add_row("", "minutes by hand for +-5 %", "" if row.minutes is None else f"{row.minutes:.0f}")
        table.add_section()
    console.print(table)
    begin, end = (written(time, result.clock) for time in (result.begin, result.end))
    console.print(f"From {begin} to {end}.")
    if result.unnoted:
        console.print(f"Without a count by hand, and left out: {', '.join(result.unnoted)}.")


def _cells(estimate: Estimate | None, factor: float, decimals: int) -> list[str]:
    if estimate is None:
        return ["", "", ""]
    return [f"{factor * number:.{decimals}f}" for number in (estimate.value, estimate.low, estimate.high)]
