"""Tables of traffic figures as files: CSV for people, Parquet with units for programs."""

from __future__ import annotations

import json
from collections.abc import Mapping
from io import BytesIO
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.csv
import pyarrow.parquet as pq

from vidtrack.output.folder import replacing

_PLAIN = pyarrow.csv.WriteOptions(include_header=False, quoting_style="none")
"""A site's names hold no commas or quotes: a table with one is refused rather than written wrong."""


def write_figures(folder: Path, tables: Mapping[str, pa.Table], report: Mapping[str, Any]) -> None:
    """Write NAME.csv and NAME.parquet of each table, and measures.json. Raises StoppedEarly on a full disk."""
    for name, table in tables.items():
        with replacing(folder / f"{name}.parquet") as new:
            pq.write_table(table, new)
        with replacing(folder / f"{name}.csv") as new:
            new.write_bytes(csv_of(table))
    with replacing(folder / "measures.json") as new:
        new.write_text(json.dumps(report, indent=2) + "\n", encoding="utf-8")


def csv_of(table: pa.Table) -> bytes:
    """A table of figures as CSV."""
    content = BytesIO()
    content.write((",".join(table.column_names) + "\n").encode())
    pyarrow.csv.write_csv(table, content, _PLAIN)
    return content.getvalue()
