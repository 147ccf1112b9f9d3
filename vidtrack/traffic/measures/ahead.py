"""Compiles the kernels of `measure` in a process of its own: the compiler does not give back the memory it takes."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Sequence
from contextlib import suppress

from vidtrack.beside import python
from vidtrack.compiled import CACHE, kept
from vidtrack.traffic.measures.encroachment import look
from vidtrack.traffic.measures.runs import Day
from vidtrack.traffic.site import Site

_LARGE = 500_000_000
"""Bytes; beside smaller tables there is room for the compiler, too: it takes 0.15 GB."""

_BEGINNING = "from vidtrack.traffic.measures.measure import beginning; beginning(sys.stdin.read())"


def compile_ahead(runs: Sequence[str], site: Site, day: Day) -> None:
    """Let another process measure the beginning of a long day, if no kernels are kept yet; what it finds is left."""
    tables = (one.folder / "tracks.parquet" for one in day.recordings)
    large = sum(path.stat().st_size for path in tables if path.exists()) > _LARGE
    if not (CACHE and large and sys.executable) or kept(look):
        return
    with suppress(OSError):  # without the other process it takes more memory, and no more
        subprocess.run(
            python(_BEGINNING),
            input=json.dumps([list(runs), site.model_dump(mode="json", by_alias=True)]),
            text=True,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            check=False,
        )
