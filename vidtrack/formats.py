"""Reads and writes tables of tracks, truth and detections: MOTChallenge text, CSV, Parquet, run folders."""

from __future__ import annotations

import difflib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays.types import Floats, Ints, Mask
from vidtrack.errors import FormatError, SourceError

if TYPE_CHECKING:
    import pyarrow as pa

Place = Callable[[int], str]
"""Returns the place of row i in its file, for error messages."""

FRAME_COLUMNS = ("frame", "scan")
ID_COLUMNS = ("track_id", "target_id")
BOX_COLUMNS = ("left_px", "top_px", "width_px", "height_px")
POSITION_COLUMNS = {"px": ("x_px", "y_px"), "m": ("x_m", "y_m", "z_m")}
SIGMA_COLUMNS = {"px": ("sigma_x_px", "sigma_y_px"), "m": ("sigma_x_m", "sigma_y_m", "sigma_z_m")}
NUMBER_COLUMNS = (
    *FRAME_COLUMNS,
    *ID_COLUMNS,
    *BOX_COLUMNS,
    *(name for columns in (POSITION_COLUMNS, SIGMA_COLUMNS) for names in columns.values() for name in names),
    "corr_xy",
    "nis",
    "conf",
)


MOST_FRAMES = 10_000_000
"""Days of video. A larger frame number is an error or a time; every frame up to it would be an empty scan."""


@dataclass(frozen=True, slots=True)
class Table:
    """Rows of tracks, truth or detections; one row per object and frame. None: the file does not contain it.

    frame  (N,) counted from 0
    id     (N,) identity; -1 for detections
    xy     (N, d) position; centre of the box if the file has only boxes
    box    (N, 4) left, top, width, height
    conf   (N,) confidence; 1 if the file has none
    cov    (N, d, d) covariance of xy
    nis    (N,) normalised innovation squared; NaN for rows without a measurement
    unit   of xy: "px" or "m"
    time_s (N,) time of a radar's scan, or of a frame with positions in metres
    """

    frame: Ints
    id: Ints
    xy: Floats
    box: Floats | None
    conf: Floats
    cov: Floats | None = None
    nis: Floats | None = None
    unit: str = "px"
    time_s: Floats | None = None

    def __len__(self) -> int:
        return len(self.frame)

    def select(self, rows: Mask | Ints) -> Table:
        """A table of the rows selected by a mask or by indices."""
        optional = (self.box, self.cov, self.nis, self.time_s)
        box, cov, nis, time_s = (None if column is None else column[rows] for column in optional)
        return Table(self.frame[rows], self.id[rows], self.xy[rows], box, self.conf[rows], cov, nis, self.unit, time_s)


def box_table(frame: Ints, identity: Ints, box: Floats, conf: Floats | None = None) -> Table:
    """A table of boxes (N, 4) with their centres as positions; `frame` (N,) counts from 0."""
    box = np.asarray(box, dtype=float).reshape(-1, 4)
    conf = np.ones(len(box)) if conf is None else conf
    return Table(np.asarray(frame, np.int64), np.asarray(identity, np.int64), box[:, :2] + box[:, 2:] / 2, box, conf)


def scans_between(frame: Ints, time_s: Floats) -> tuple[Ints, Floats]:
    """Numbers and times (K,) of all scans from the first row to the last one; some may have no row (N,)."""
    known, first = np.unique(frame, return_index=True)
    number = np.arange(known[0], known[-1] + 1)
    return number, np.interp(number, known, time_s[first])


def usual_step(time_s: Floats) -> float:
    """Median time between scans at these times (K,) in order; 0 if all are the same."""
    steps_s = np.diff(time_s)
    return float(np.median(steps_s[steps_s > 0])) if (steps_s > 0).any() else 0.0


def more_scans(number: Ints, time_s: Floats, step_s: float, before: int, after: int) -> tuple[Ints, Floats]:
    """These scans (K,) in order, and so many more before and after them, every step_s."""
    earlier, later = np.arange(-before, 0), np.arange(1, after + 1)
    return (
        np.concatenate([number[0] + earlier, number, number[-1] + later]),
        np.concatenate([time_s[0] + earlier * step_s, time_s, time_s[-1] + later * step_s]),
    )


def interpolated(truth: Table, number: Ints, time_s: Floats, longest_gap_s: float | Floats) -> Table:
    """The places of all targets at scans of these numbers and times (K,), linearly between rows of the truth.

    longest_gap_s  between rows farther apart a target's place is not known; of all targets, or of each in order of ids
    """
    assert truth.time_s is not None
    scans, ids, places = [], [], []
    targets = np.unique(truth.id)
    for target, gap_s in zip(targets, np.broadcast_to(longest_gap_s, targets.shape), strict=True):
        own = np.flatnonzero(truth.id == target)
        own = own[np.argsort(truth.time_s[own], kind="stable")]
        at_s = truth.time_s[own]
        known = _known(at_s, time_s, float(gap_s))
        scans.append(number[known])
        ids.append(np.full(len(scans[-1]), target))
        places.append(np.column_stack([np.interp(time_s[known], at_s, place) for place in truth.xy[own].T]))
    frame = np.concatenate(scans)
    return Table(frame, np.concatenate(ids), np.concatenate(places), None, np.ones(len(frame)), unit=truth.unit)


def _known(reported_s: Floats, time_s: Floats, longest_gap_s: float) -> Mask:
    """(K,) times at a report, or between two that are at most longest_gap_s apart."""
    after = np.clip(np.searchsorted(reported_s, time_s), 1, max(len(reported_s) - 1, 1))
    before, after = after - 1, np.minimum(after, len(reported_s) - 1)
    inside = (reported_s[before] <= time_s) & (time_s <= reported_s[after])
    return np.asarray(inside & (reported_s[after] - reported_s[before] <= longest_gap_s))


def read(path: str | Path) -> Table:
    """Read a MOT text, CSV or Parquet file, recognised by its content, or the tracks of a run folder.

    In a run folder `mot.txt` is preferred (boxes), then `tracks.parquet`, then `tracks.csv`.
    Raises SourceError if the file is missing, FormatError naming the line that cannot be read.
    """
    path = Path(path)
    if path.is_dir():
        return read(_first_of(path, "mot.txt", "tracks.parquet", "tracks.csv"))
    if not path.is_file():
        raise SourceError(f"cannot open {path}: no such file or run folder")
    with path.open("rb") as file:
        start = file.read(4096)
    if start[:4] == b"PAR1":
        return read_parquet(path)
    if b"\0" in start:
        raise FormatError(f"{path} is no table of tracks: it is not text, and not Parquet")
    if not start.strip():
        return read_csv(path) if path.suffix.lower() == ".csv" else read_mot(path)
    return read_mot(path) if _is_number(start.replace(b",", b" ").split()[0]) else read_csv(path)


def read_states(folder: str | Path) -> Table:
    """Read the table of a run folder that contains covariances and NIS: `read` in the opposite order."""
    return read(_first_of(Path(folder), "tracks.parquet", "tracks.csv", "mot.txt"))


def _first_of(folder: Path, *names: str) -> Path:
    for name in names:
        if (folder / name).is_file():
            return folder / name
    raise SourceError(f"{folder} holds no {' or '.join(names)}; give a file or the folder of a finished run")


def _is_number(text: bytes) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def read_mot(path: str | Path) -> Table:
    """Read `frame,id,left,top,width,height[,conf,...]` with frames from 1, the form of MOTChallenge.

    Detections (id -1) may repeat in a frame, tracks may not. An empty file gives a table without rows.
    Raises FormatError naming the line.
    """
    lines, rows = [], []
    with Path(path).open(encoding="utf-8", errors="replace") as file:
        for line, text in enumerate(file, start=1):
            if text.strip():
                lines.append(line)
                rows.append(_mot_row(text, f"{path}, line {line}"))
    values = np.array(rows, dtype=float).reshape(-1, 7)

    def place(i: int) -> str:
        return f"{path}, line {lines[i]}"

    frame = _whole("frame", values[:, 0], place)
    identity = _whole("id", values[:, 1], place)
    _refuse(frame < 1, "frame", frame, "MOT frames count from 1", place)
    _refuse(frame > MOST_FRAMES, "frame", frame, f"at most {MOST_FRAMES} are read", place)
    _refuse(
        np.minimum(values[:, 4], values[:, 5]) < 0, "width, height", values[:, 4:6], "neither may be negative", place
    )
    _refuse_repeated(frame, identity, place)
    return box_table(frame - 1, identity, values[:, 2:6], values[:, 6])


def _mot_row(text: str, place: str) -> list[float]:
    """The first seven numbers of a line; a missing confidence is 1."""
    fields = text.replace(",", " ").split()[:7]
    if len(fields) < 6:
        raise FormatError(f"{place}: {text.strip()!r} is not frame,id,left,top,width,height[,conf,...]")
    try:
        row = [float(field) for field in fields]
    except ValueError as error:
        raise FormatError(f"{place}: {error}; every field must be a number") from None
    if not np.isfinite(row).all():
        raise FormatError(f"{place}: {text.strip()!r} is not finite; every field must be a finite number")
    return row if len(row) == 7 else [*row, 1.0]


def write_mot(path: str | Path, table: Table) -> None:
    """Write boxes in MOT form, frames from 1, sorted by frame. Raises FormatError for a table without boxes."""
    if table.box is None:
        raise FormatError(f"cannot write {path}: the table has positions but no boxes, which MOT needs")
    with Path(path).open("w", encoding="utf-8") as file:
        for i in np.argsort(table.frame, kind="stable"):
            box = ",".join(f"{value:.10g}" for value in table.box[i])
            file.write(f"{table.frame[i] + 1},{table.id[i]},{box},{table.conf[i]:.6g},-1,-1,-1\n")


def read_csv(path: str | Path) -> Table:
    """Read a CSV table with the columns of `tracks.csv` or of a simulated `truth.csv`.

    Raises FormatError naming the line, or the missing column and similar names.
    """
    import pyarrow as pa
    import pyarrow.csv

    try:
        columns = pyarrow.csv.read_csv(
            path,
            read_options=pyarrow.csv.ReadOptions(use_threads=False),  # errors name the row only with one thread
            convert_options=pyarrow.csv.ConvertOptions(column_types=dict.fromkeys(NUMBER_COLUMNS, pa.float64())),
        )
    except pa.ArrowInvalid as error:
        raise FormatError(f"{path}: {str(error).strip().replace('Row #', 'line ')}") from None
    return _from_columns(columns, str(path), lambda i: f"{path}, line {i + 2}")


def read_parquet(path: str | Path) -> Table:
    """Read a Parquet table with the columns of `tracks.parquet`. Raises FormatError as `read_csv`."""
    import pyarrow as pa
    import pyarrow.parquet

    try:
        columns = pyarrow.parquet.read_table(path)
    except (pa.ArrowInvalid, OSError) as error:
        raise FormatError(f"{path} is not a readable Parquet file: {error}") from None
    return _from_columns(columns, str(path), lambda i: f"{path}, row {i + 1}")


def _from_columns(columns: pa.Table, path: str, place: Place) -> Table:
    """The table from columns by name; positions are preferred in metres, then pixels, then centres of boxes."""
    names = columns.column_names

    def numbers(*wanted: str) -> Floats:
        return np.column_stack([columns[name].to_numpy().astype(float) for name in wanted])

    frame_column = _one_of(FRAME_COLUMNS, names, path)
    id_column = _one_of(ID_COLUMNS, names, path)
    frame = _whole(frame_column, numbers(frame_column)[:, 0], place)
    identity = _whole(id_column, numbers(id_column)[:, 0], place)
    _refuse(frame < 0, frame_column, frame, "frames count from 0", place)
    _refuse_repeated(frame, identity, place)

    box = numbers(*BOX_COLUMNS) if set(BOX_COLUMNS) <= set(names) else None
    unit = next((unit for unit, wanted in POSITION_COLUMNS.items() if set(wanted[:2]) <= set(names)), None)
    if unit is not None:
        position = [name for name in POSITION_COLUMNS[unit] if name in names]
        xy = numbers(*position)
    elif box is not None:
        position, unit, xy = list(BOX_COLUMNS), "px", box[:, :2] + box[:, 2:] / 2
    else:
        raise FormatError(f"{path} has no positions: {_nearest('x_px', names)}; x_px,y_px or x_m,y_m or a box needed")
    _refuse(~np.isfinite(xy.sum(axis=1)), ", ".join(position), xy, "must be finite", place)

    sigma = SIGMA_COLUMNS[unit][: xy.shape[1]]
    cov = None
    if set(sigma) <= set(names):
        cov = _covariance(numbers(*sigma), numbers("corr_xy")[:, 0] if "corr_xy" in names else np.zeros(len(xy)))
    conf = numbers("conf")[:, 0] if "conf" in names else np.ones(len(xy))
    nis = numbers("nis")[:, 0] if "nis" in names else None
    if box is not None and len(box) and np.isnan(box).all():
        box = None
    timed = (frame_column == "scan" or unit == "m") and "time_s" in names and _is_numeric(columns["time_s"])
    return Table(frame, identity, xy, box, conf, cov, nis, unit, numbers("time_s")[:, 0] if timed else None)


def _is_numeric(column: pa.ChunkedArray) -> bool:
    import pyarrow as pa

    return bool(pa.types.is_floating(column.type) or pa.types.is_integer(column.type))


def _covariance(sigma: Floats, corr: Floats) -> Floats:
    """Covariances (N, d, d) from standard deviations (N, d) and the correlation (N,) of x and y."""
    cov = np.einsum("ni,ij->nij", sigma**2, np.eye(sigma.shape[1]))
    cov[:, 0, 1] = cov[:, 1, 0] = corr * sigma[:, 0] * sigma[:, 1]
    return cov


def _one_of(wanted: tuple[str, ...], names: list[str], path: str) -> str:
    """The first wanted column that exists. Raises FormatError with similar names."""
    found = next((name for name in wanted if name in names), None)
    if found is None:
        raise FormatError(f"{path} has no column {' or '.join(wanted)}: {_nearest(wanted[0], names)}")
    return found


def _nearest(wanted: str, names: list[str]) -> str:
    near = difflib.get_close_matches(wanted, names, n=3, cutoff=0.4) or names[:6]
    return f"nearest {'is' if len(near) == 1 else 'are'} {', '.join(map(repr, near))}"


def _whole(name: str, values: Floats, place: Place) -> Ints:
    """Values as integers. Raises FormatError for the first missing or fractional value."""
    _refuse(~(np.isfinite(values) & (values == np.floor(values))), name, values, "must be a whole number", place)
    return values.astype(np.int64)


def _refuse(bad: Mask, name: str, values: NDArray, rule: str, place: Place) -> None:
    """Raise FormatError for the first bad row."""
    if bad.any():
        i = int(np.argmax(bad))
        raise FormatError(f"{place(i)}: {name} is {values[i]}; {rule}")


def _refuse_repeated(frame: Ints, identity: Ints, place: Place) -> None:
    """Raise FormatError for an identity that occurs twice in one frame."""
    order = np.lexsort((np.arange(len(frame)), identity, frame))
    again = (np.diff(frame[order]) == 0) & (np.diff(identity[order]) == 0) & (identity[order][1:] >= 0)
    if again.any():
        k = int(np.argmax(again))
        first, second = order[k], order[k + 1]
        raise FormatError(f"{place(second)}: id {identity[second]} stands twice in a frame, first at {place(first)}")


def damaged(path: Path, error: Exception) -> FormatError:
    """What is wrong with a table of tracks, and what to do."""
    folder, advice = path.parent, "copy it again, or make the run again"
    if path.suffix == ".csv":
        advice = f"vidtrack repair {folder} may help"
    elif (folder / "tracks.csv").is_file():
        advice = f"vidtrack repair {folder} makes it from tracks.csv"
    return FormatError(f"{path} is damaged: {' '.join(str(error).split())}; {advice}")  # some errors have several lines
