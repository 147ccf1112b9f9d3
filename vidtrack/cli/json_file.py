"""--json: one object for a machine."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import click

from vidtrack.errors import OutputError


def write_json(content: Mapping[str, Any], path: str) -> None:
    """Into a file, or to stdout for "-". Raises OutputError where the file cannot be written."""
    text = json.dumps(content, indent=2) + "\n"
    if path == "-":
        click.echo(text, nl=False)
        return
    try:
        Path(path).write_text(text, encoding="utf-8")
    except OSError as error:
        raise OutputError(f"cannot write {path}: {error.strerror}; choose another file for --json") from None
