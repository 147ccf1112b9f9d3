"""`vidtrack measure` and `vidtrack report` over all runs of a batch: one site and one day at a time."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from vidtrack.run.batch.archive import Portion

MEASURES, DAYS, TABLES = "measures", "days", "tables"
"""Folder of the measures in a batch's own; in it, one of all measures of a site and day, and one of each table."""


def measure_archive(archive: str, site: Path | None, output: Path | None, force: bool, quiet: bool) -> Path:
    """Write `days/SITE/DAY` as `vidtrack measure` writes it, and `tables/TABLE/site=SITE/day=DAY`; returns the folder.

    The measures of an earlier call are replaced. What is in memory is one day of one site. Raises SourceError for a
    batch without runs to measure, StoppedEarly if days could not be measured.
    """
    from vidtrack.errors import ConfigError, Error, StoppedEarly
    from vidtrack.output.folder import open_folder
    from vidtrack.run.batch.archive import portions
    from vidtrack.run.batch.remote import is_remote

    if output is None and is_remote(archive):
        raise ConfigError("the measures of a batch at an address need a folder of this machine: give one with -o")
    found = portions(archive, site)
    folder = open_folder(Path(archive, MEASURES) if output is None else output, MEASURES, force or output is None)
    _remove_older(folder)
    failed = 0
    for number, portion in enumerate(found, start=1):
        try:
            report = _measure(portion, site, folder)
        except StoppedEarly:
            raise
        except Error as error:
            failed += 1
            click.echo(f"vidtrack: {portion.site}, {portion.day}: {error}", err=True)
            continue
        if not quiet:
            of = f"{number} of {len(found)}: {portion.site}, {portion.day}"
            click.echo(f"vidtrack: {of}: {len(portion.rows)} runs, {report['crossings']} crossings", err=True)
    if failed:
        raise StoppedEarly(f"{failed} of {len(found)} days could not be measured; the others are in {folder}")
    return folder


def _remove_older(folder: Path) -> None:
    """Delete the measures of an earlier call: they may be of days that are no more. What was corrected by hand stays.

    Raises StoppedEarly for what cannot be deleted.
    """
    import shutil
    from contextlib import suppress

    from vidtrack.output.corrections import NAME
    from vidtrack.output.folder import writing

    for part in folder.glob(f"{TABLES}/*/site=*"):
        with writing(part):
            shutil.rmtree(part)
    for day in [path.parent for path in folder.glob(f"{DAYS}/*/*/measures.json")]:
        with writing(day):
            for file in day.iterdir():
                if file.is_file() and file.name != NAME:
                    file.unlink()
        with suppress(OSError):  # corrections are in it, or other days
            day.rmdir()
            day.parent.rmdir()


def _measure(portion: Portion, site: Path | None, folder: Path) -> Mapping[str, Any]:
    """Measure a site's day, and write it; returns measures.json."""
    import pyarrow.parquet as pq

    from vidtrack.output.figures import write_figures
    from vidtrack.output.folder import replacing, usable
    from vidtrack.run.batch.archive import folder_name
    from vidtrack.traffic.measures.measure import measured
    from vidtrack.traffic.measures.runs import site_of
    from vidtrack.traffic.site import read_site

    with portion.runs() as runs:
        used = site_of(runs, site)
        found, text = measured(runs, read_site(used)), used.read_bytes()
    names = folder_name(portion.site), folder_name(portion.day)
    own = usable(folder / DAYS / names[0] / names[1])
    write_figures(own, found.tables, found.report)
    with replacing(own / "site.toml") as new:
        new.write_bytes(text)
    for name, table in found.tables.items():
        part = usable(folder / TABLES / name / f"site={names[0]}" / f"day={names[1]}") / "part.parquet"
        with replacing(part) as new:
            pq.write_table(table, new)
    return found.report


def report_archive(measures: Path, output: Path | None, force: bool, quiet: bool) -> Path:
    """Write a report of each site and day that was measured, and a page that leads to them; returns the folder."""
    from vidtrack.errors import SourceError
    from vidtrack.output.corrections import reviewed
    from vidtrack.output.folder import open_folder, usable
    from vidtrack.output.report.archive import DayLine, write_contents
    from vidtrack.output.report.report import write_report
    from vidtrack.traffic.report.findings import read_findings

    days = sorted(path.parent for path in measures.glob(f"{DAYS}/*/*/measures.json"))
    if not days:
        raise SourceError(f"{measures} has no measured days; run vidtrack measure first")
    folder = open_folder(measures.parent / "report" if output is None else output, "report", force or output is None)
    lines = []
    for day in days:
        place = f"{day.parent.name}/{day.name}"
        found = read_findings(day)
        write_report(usable(folder / place), found, None, reviewed(day))
        report = found.report
        lines.append(
            DayLine(report["site"], day.name, f"{place}/report.html", report["watched_s"], report["crossings"],
                    report["trips"], report["complete_trips"])
        )  # fmt: skip
        if not quiet:
            click.echo(f"vidtrack: {len(lines)} of {len(days)}: {report['site']}, {day.name}", err=True)
    write_contents(folder, lines)
    return folder


def measured_days(folder: Path) -> Path | None:
    """The folder of the measures of a batch: this one, or the one in a batch's own; None for any other folder."""
    return next((one for one in (folder, folder / MEASURES) if (one / DAYS).is_dir()), None)
