"""--json: a report as one JSON object."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, TypeVar

import click

from vidtrack.errors import OutputError

Function = TypeVar("Function", bound=Callable[..., Any])


def json_option(function: Function) -> Function:
    """--json."""
    return click.option("--json", "json_to", metavar="FILE|-", help="Write one JSON object to FILE, or print it.")(
        function
    )


def deliver(content: Mapping[str, Any], json_to: str | None, file: Path | None, quiet: bool) -> bool:
    """Write a report to the files of --json and -o; returns whether to print it as a table too."""
    if file is not None:
        write_json(content, str(file))
    if json_to is not None:
        write_json(content, json_to)
    return json_to != "-" and not quiet


def write_json(content: Mapping[str, Any], path: str) -> None:
    """Write to a file, or to stdout for "-". Raises OutputError if the file cannot be written."""
    text = json.dumps(content, indent=2) + "\n"
    if path == "-":
        click.echo(text, nl=False)
        return
    try:
        Path(path).write_text(text, encoding="utf-8")
    except OSError as error:
        raise OutputError(f"cannot write {path}: {error.strerror}; choose another file for --json") from None
