"""Progress of a run, as a bar on a terminal and as lines at intervals otherwise, and its outcome."""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TypeVar

import click

Item = TypeVar("Item")
LINE_EVERY_S = 10.0


def progress(
    items: Iterable[Item], expected: int | None, name: str, quiet: bool, unit: str = "frame"
) -> Iterator[Item]:
    """Yields the items and shows the progress on stderr; `unit` is the name of an item."""
    if quiet:
        return iter(items)
    return _bar(items, expected, name, unit) if sys.stderr.isatty() else _lines(items, expected, name, unit)


def _bar(items: Iterable[Item], expected: int | None, name: str, unit: str) -> Iterator[Item]:
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("{task.fields[rate]:.0f} " + f"{unit}s/s"),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(name, total=expected, rate=0.0)
        began, told = time.monotonic(), 0.0
        for done, item in enumerate(items, start=1):
            yield item
            elapsed = time.monotonic() - began
            if elapsed - told > 0.1:
                bar.update(task, completed=done, rate=done / elapsed)
                told = elapsed


def _lines(items: Iterable[Item], expected: int | None, name: str, unit: str) -> Iterator[Item]:
    began = told = time.monotonic()
    of = f" of {expected}" if expected else ""
    done = 0
    for done, item in enumerate(items, start=1):
        yield item
        now = time.monotonic()
        if now - told > LINE_EVERY_S:
            click.echo(f"{name}: {unit} {done}{of}, {done / (now - began):.0f} {unit}s/s", err=True)
            told = now
    click.echo(f"{name}: {done} {unit}{'s' * (done != 1)} in {time.monotonic() - began:.1f} s", err=True)


def report_outcome(folder: Path, quiet: bool, none: str = "no tracks") -> None:
    """Print the number of tracks and crossings of a finished run to stderr; `none` is the text without tracks."""
    if quiet:
        return
    from vidtrack.traffic.lines import counted

    summary = json.loads((folder / "summary.json").read_text())
    tracks = summary["tracks"]
    found = f"{tracks} track{'s' * (tracks != 1)}" if tracks else none
    for warning in summary.get("warnings", ()):
        click.echo(f"warning: {warning['what']} (at {warning['time_s']:.1f} s)", err=True)
    click.echo("; ".join([found, *(counted(line, ways) for line, ways in summary["counts"].items())]), err=True)
