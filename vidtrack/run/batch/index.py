"""index.parquet: one row for each source of a batch, with what came of it."""

from __future__ import annotations

import io
from collections.abc import Iterable
from dataclasses import asdict, dataclass, fields

import pyarrow as pa
import pyarrow.parquet as pq

from vidtrack.errors import OutputError

INDEX = "index.parquet"
WAITING, DONE, SET_ASIDE = "waiting", "done", "set aside"
"""States of a source."""


@dataclass(slots=True)
class Row:
    """What is known of a source.

    source     its address, without credentials
    folder     of its results, below `results`
    site       path of its site; None: tracked without one
    start      time of its first picture with its zone, as ISO 8601 has it; None: not known
    state      WAITING, DONE or SET_ASIDE
    error      why it was set aside
    attempts   how often it, or a part of it, was begun in the last batch that tried
    seconds    of work, by the clock
    frames, media_s, coverage, tracks   of the run: pictures, seconds of video, share of them that was watched, tracks
    truncated  the file ends before it should
    bytes, stamp   of the source
    key        digest of source, settings and version
    version    of vidtrack
    """

    source: str
    folder: str
    site: str | None = None
    start: str | None = None
    state: str = WAITING
    error: str | None = None
    attempts: int = 0
    seconds: float = 0.0
    frames: int | None = None
    media_s: float | None = None
    coverage: float | None = None
    tracks: int | None = None
    truncated: bool | None = None
    bytes: int = 0
    stamp: str = ""
    key: str = ""
    version: str = ""


_KINDS = {
    "str": pa.string(),
    "int": pa.int64(),
    "float": pa.float64(),
    "bool": pa.bool_(),
}
_UNITS = {"seconds": "s", "media_s": "s", "bytes": "byte"}
SCHEMA = pa.schema(
    pa.field(column.name, _KINDS[str(column.type).removesuffix(" | None")],
             metadata={"unit": _UNITS.get(column.name, "1")})
    for column in fields(Row)
)  # fmt: skip


def index_bytes(rows: Iterable[Row]) -> bytes:
    """The rows as a Parquet file."""
    content = io.BytesIO()
    pq.write_table(pa.Table.from_pylist([asdict(row) for row in rows], SCHEMA), content)
    return content.getvalue()


def rows_of(content: bytes | None, where: str) -> dict[str, Row]:
    """The rows of an index by source; none without one. Raises OutputError for what is not an index."""
    if content is None:
        return {}
    try:
        table = pq.read_table(io.BytesIO(content))
        return {row["source"]: Row(**row) for row in table.to_pylist()}
    except (pa.ArrowInvalid, TypeError, KeyError) as error:
        raise OutputError(f"{INDEX} in {where} is not that of a batch of this version: {error}") from None
