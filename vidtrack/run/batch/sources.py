"""The sources of a batch: files, folders, patterns and tables become one list."""

from __future__ import annotations

import glob
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from difflib import get_close_matches
from hashlib import sha256
from io import BytesIO
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.csv
import pyarrow.parquet as pq

from vidtrack.errors import ConfigError, FormatError, SourceError
from vidtrack.recording.source import is_recording
from vidtrack.run.batch.remote import is_remote, local_path, pieces, remote_files, without_secrets
from vidtrack.video.pictures import images_in

VIDEOS = frozenset(
    {".3gp", ".asf", ".avi", ".flv", ".h264", ".h265", ".hevc", ".m2ts", ".m4v", ".mjpeg", ".mjpg", ".mkv", ".mov"}
    | {".mp4", ".mpeg", ".mpg", ".mts", ".ts", ".webm", ".wmv"}
)
"""Endings of the files that are taken from a folder."""
TABLES = (".csv", ".parquet")
COLUMNS = ("source", "site", "start", "settings")
"""Of a table of sources; only the first is needed."""


@dataclass(frozen=True, slots=True)
class Source:
    """One input of a batch.

    address   path from the root, or an fsspec address
    site      path of its site.toml; None: that of the batch
    start     time of its first picture, with a zone; None: not known
    settings  assignments "a.b=value" besides those of the batch
    size      bytes; 0 for a folder of images, or a file that is missing
    stamp     what changes when the file does: its time of change, or the tag of its store
    """

    address: str
    site: str | None = None
    start: datetime | None = None
    settings: tuple[str, ...] = ()
    size: int = 0
    stamp: str = ""

    @property
    def shown(self) -> str:
        """The address without credentials."""
        return without_secrets(self.address)

    @property
    def name(self) -> str:
        """Name of the folder of its results: equal names from two places differ."""
        stem = "".join(c if c.isalnum() or c in "._-" else "_" for c in Path(self.shown).stem)[:80].lstrip(".")
        return f"{stem or 'source'}-{sha256(self.shown.encode()).hexdigest()[:10]}"


def listed(given: Sequence[str]) -> list[Source]:
    """All sources in files, folders, patterns and tables, in this order.

    Raises SourceError for what is not there or holds no source, FormatError or ConfigError for a bad table, and
    ConfigError for the same source twice.
    """
    found = [_looked_at(source) for text in given for source in _named(text)]
    if not found:
        raise SourceError(f"there is no source in {', '.join(given)}; give files, folders, patterns or a table")
    seen: set[str] = set()
    for source in found:
        if source.shown in seen:
            raise ConfigError(f"{source.shown} is listed twice; it would be counted twice: name it once")
        seen.add(source.shown)
    return found


def _named(text: str) -> Iterator[Source]:
    """The sources that an argument of the command means."""
    if text.lower().endswith(TABLES):
        yield from _of_table(text)
    elif is_remote(text):
        yield from (Source(one, size=size, stamp=stamp) for one, size, stamp in remote_files(text, VIDEOS))
    else:
        yield from (Source(str(path.absolute())) for path in _local(local_path(text)))


def _local(text: str) -> list[Path]:
    place = Path(text)
    if place.is_dir():
        return [place] if is_recording(text) else _in_folder(place)
    if place.exists():
        return [place]
    if glob.has_magic(text):
        found = sorted(Path(match) for match in glob.glob(text, recursive=True))
        files = [path for path in found if path.is_file()]
        if not files:
            raise SourceError(f"nothing matches {text}; put the pattern in quotes, and look at the folder")
        return files
    raise SourceError(f"cannot open {text}: no such file or folder")


def _in_folder(folder: Path) -> list[Path]:
    """The videos below a folder; the folder itself if it holds images instead."""
    videos = sorted(path for path in folder.rglob("*") if path.suffix.lower() in VIDEOS and path.is_file())
    videos = [path for path in videos if not path.name.startswith(".")]
    if videos:
        return videos
    try:
        images_in(folder)
    except SourceError:
        raise SourceError(f"{folder} holds no video and no images") from None
    return [folder]


def _of_table(text: str) -> Iterator[Source]:
    """The rows of a table; relative paths in it begin at its folder."""
    table = _table(text)
    names = table.column_names
    if "source" not in names:
        raise FormatError(f"{without_secrets(text)} has no column source; it has {', '.join(names) or 'none'}")
    for name in names:
        if name not in COLUMNS:
            near = get_close_matches(name, COLUMNS, n=1)
            hint = f"did you mean {near[0]}?" if near else f"known are {', '.join(COLUMNS)}"
            raise FormatError(f"{without_secrets(text)} has an unknown column {name}; {hint}")
    for number, row in enumerate(table.to_pylist(), start=1):
        yield _of_row({name: value for name, value in row.items() if value not in (None, "")}, text, number)


def _of_row(row: Mapping[str, Any], table: str, number: int) -> Source:
    where = f"row {number} of {without_secrets(table)}"
    if "source" not in row:
        raise FormatError(f"{where} names no source")
    return Source(
        address=_from(table, str(row["source"])),
        site=_from(table, str(row["site"])) if "site" in row else None,
        start=_time(row["start"], where) if "start" in row else None,
        settings=tuple(one.strip() for one in str(row.get("settings", "")).split(";") if one.strip()),
    )


def _from(table: str, text: str) -> str:
    if is_remote(text):
        return text
    path = Path(local_path(text))
    return str(path.absolute() if is_remote(table) else (Path(local_path(table)).parent / path).absolute())


def _time(value: object, where: str) -> datetime:
    try:
        time = value if isinstance(value, datetime) else datetime.fromisoformat(str(value))
    except ValueError:
        raise FormatError(f"{where}: {value!r} is no time; write 2026-06-01T07:00:00+02:00") from None
    if time.tzinfo is None:
        raise FormatError(f"{where}: the time {value} has no zone; write for example {time.isoformat()}+02:00")
    return time


def _table(text: str) -> pa.Table:
    shown = without_secrets(text)
    try:
        file = BytesIO(b"".join(pieces(text)))
    except OSError as error:
        raise SourceError(f"cannot open {shown}: {error.strerror or error}") from None
    try:
        if text.lower().endswith(".parquet"):
            return pq.read_table(file)
        words = pyarrow.csv.ConvertOptions(column_types=dict.fromkeys(COLUMNS, pa.string()))
        return pyarrow.csv.read_csv(file, convert_options=words)
    except (pa.ArrowInvalid, OSError) as error:  # Arrow gives damaged pages as OSError
        raise FormatError(f"cannot read the table {shown}: {error}") from None


def _looked_at(source: Source) -> Source:
    """The source with its size and time of change; unchanged if it cannot be seen, which its task will say."""
    if is_remote(source.address):
        if source.stamp:
            return source
        _, size, stamp = next(iter(remote_files(source.address, VIDEOS)))
        return replace(source, size=size, stamp=stamp)
    path = Path(source.address)
    try:
        stat = path.stat()
        newest = max((one.stat().st_mtime_ns for one in path.iterdir()), default=0) if path.is_dir() else 0
    except OSError:
        return source
    return replace(source, size=0 if path.is_dir() else stat.st_size, stamp=str(max(stat.st_mtime_ns, newest)))
