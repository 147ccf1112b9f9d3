"""The tables of figures: their columns, with units."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from typing import Any

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from vidtrack.arrays.types import Floats, Ints

_TIME = pa.timestamp("ms", "UTC")
_KINDS: dict[str, pa.DataType] = {"": pa.string(), "1": pa.float64(), "n": pa.int64(), "yes": pa.bool_(), "utc": _TIME}


def table(columns: Mapping[str, tuple[str, Any]]) -> pa.Table:
    """A table of columns name -> (unit, values); NaN and None become empty cells.

    Units besides those of physics: "" words, "1" a pure number, "n" a whole number, "yes" true or false, "utc" time.
    """
    fields, arrays = [], []
    for name, (unit, values) in columns.items():
        kind = _KINDS.get(unit, pa.float64())
        if kind == pa.float64():
            values = np.round(np.asarray(values, float), 4)
        elif kind == pa.int64():
            values = np.asarray(values, float)
            values = pa.array(values, pa.float64(), from_pandas=True).cast(kind)
        arrays.append(pa.array(values, kind, from_pandas=True) if not isinstance(values, pa.Array) else values)
        fields.append(pa.field(name, kind, metadata={"unit": "1" if unit in ("n", "yes", "") else unit}))
    return pa.Table.from_arrays(arrays, schema=pa.schema(fields))


def words(names: Sequence[str | None], number: Ints) -> pa.Array:
    """(N,) the name of each number (N,)."""
    return pa.array(names, pa.string()).take(pa.array(number))


def stamps(utc: datetime | None, t: Floats) -> NDArray[np.datetime64]:
    """UTC of times of the site [s], to the millisecond; NaT where it is not known."""
    if utc is None:
        return np.full(len(t), np.datetime64("NaT", "ms"))
    since = np.full(len(t), np.timedelta64("NaT", "ms"))
    known = np.isfinite(t)
    since[known] = np.round(1000 * t[known]).astype("timedelta64[ms]")
    return np.datetime64(utc.astimezone(UTC).replace(tzinfo=None), "ms") + since
