"""Compiles the kernels of `measure` in a process of its own: the compiler does not give back the memory it takes."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Sequence

from vidtrack.compiled import CACHE, kept
from vidtrack.traffic.measures.encroachment import look
from vidtrack.traffic.measures.runs import Day
from vidtrack.traffic.site import Site

_LARGE = 500_000_000
"""Bytes; beside smaller tables there is room for the compiler, too: it takes 0.15 GB."""

_BEGINNING = "import sys; from vidtrack.traffic.measures.measure import beginning; beginning(sys.stdin.read())"


def compile_ahead(runs: Sequence[str], site: Site, day: Day) -> None:
    """Let another process measure the beginning of a long day, if no kernels are kept yet; what it finds is left."""
    tables = (one.folder / "tracks.parquet" for one in day.recordings)
    if CACHE and not kept(look) and sum(path.stat().st_size for path in tables if path.exists()) > _LARGE:
        subprocess.run(
            [sys.executable, "-c", _BEGINNING],
            input=json.dumps([list(runs), site.model_dump(mode="json", by_alias=True)]),
            text=True,
            stderr=subprocess.DEVNULL,
            check=False,
        )
