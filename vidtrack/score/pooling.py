"""Joins several sequences, to score them as one."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vidtrack.formats import Table


def pool(runs: Iterable[tuple[Table, Table]]) -> tuple[Table, Table]:
    """Join sequences of (result, truth) into one result and one truth, with distinct frames and identities.

    Their scores are those of TrackEval's combined sequences: every object counts once, independent of the
    length of its sequence.
    """
    results: list[Table] = []
    truths: list[Table] = []
    frame = identity = 0
    for pair in runs:
        for tables, table in zip((results, truths), pair, strict=True):
            tables.append(replace(table, frame=table.frame + frame, id=table.id + identity))
        frame = 1 + max(table.frame.max(initial=frame) for table in (results[-1], truths[-1]))
        identity = 1 + max(table.id.max(initial=identity) for table in (results[-1], truths[-1]))
    return _stack(results), _stack(truths)


def _stack(tables: Sequence[Table]) -> Table:
    """Tables concatenated, with the columns common to all."""

    def column(name: str) -> NDArray | None:
        columns = [getattr(table, name) for table in tables]
        return None if any(values is None for values in columns) else np.concatenate(columns)

    columns: dict[str, Any] = {
        name: column(name) for name in ("frame", "id", "xy", "box", "conf", "cov", "nis", "time_s")
    }
    return replace(tables[0], **columns)
