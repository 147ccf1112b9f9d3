"""The rows of finished runs, a block at a time: only the columns that figures need."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np
import pyarrow as pa

from vidtrack.arrays.covariance import correlation
from vidtrack.arrays.rows import make_room
from vidtrack.arrays.types import Floats, Ints, Mask
from vidtrack.compiled import kernel
from vidtrack.errors import ConfigError
from vidtrack.traffic.boxes import cut_ones, partly_hidden, uncut
from vidtrack.traffic.calibration.ground import Ground
from vidtrack.traffic.footprint import Footprints, footprint
from vidtrack.traffic.lines import foot_of
from vidtrack.traffic.measures.blocks import blocks, column_names, numbers, side_by_side, whole_pictures
from vidtrack.traffic.measures.runs import Day, Recording
from vidtrack.video.readahead import ReadAhead

BOX = ("left_px", "top_px", "width_px", "height_px")
_PICTURE = ("vx_px_s", "vy_px_s", "sigma_x_px", "sigma_y_px", *BOX)
_ALWAYS = ("time_s", "track_id", "status")
_ROAD = (
    *("x_m", "y_m", "sigma_x_m", "sigma_y_m", "corr_xy_m", "speed_kmh", "speed_sigma_kmh", "speed_shared_sigma_kmh"),
    *("heading_deg", "length_m", "length_sigma_m", "width_m"),
)
_STATE = (
    *("x_px", "y_px", "vx_px_s", "vy_px_s", "sigma_x_px", "sigma_y_px", "sigma_vx_px_s", "sigma_vy_px_s"),
    *("corr_xy", "corr_vxy", "corr_x_vx", "corr_x_vy", "corr_y_vx", "corr_y_vy", *BOX),
)
EDGE_COLUMNS = ("seen_left_px", "seen_top_px", "seen_right_px", "seen_bottom_px")
ROAD_COLUMNS = (*_ALWAYS, *_ROAD, *BOX)
"""What is read of a run with metres, besides the edges."""
_NOT_SEEN = "coasting"


@dataclass(frozen=True, slots=True)
class Rows:
    """N rows in order of time; NaN where a value is not known.

    track    (N,) vehicles' numbers over the whole day, from 0
    t        (N,) s, of the site
    seen     (N,) the picture of that time shows the track
    merged   (N,) it shares a blob with others
    hidden   (N,) its box may not be that of its whole vehicle, see `partly_hidden`: its length is no measurement
    xy       (N, 2) where it stands: the middle of the footprint in metres with a calibration, else in pixels as far as
             its box tells
    sigma    (N,) standard deviation of its own position error, in the unit of xy
    margin   (N,) how far it must pass a gate by, in the unit of xy
    v        (N, 2) its velocity, in the unit of xy per second
    speed    (N,) m/s on the road; known also where the heading, and so v, is not
    speed_sigma, speed_shared   (N,) m/s; its standard deviations, own and by the calibration
    length, length_sigma, width   (N,) m
    ahead    (N, 2) unit vectors along the vehicles on the road
    spread   (N, 3) m2; variances of its own position error, in x and in y, and their covariance
    edge     (N, 4) px of the picture; left, top, right and lower edges that were seen of the vehicle alone; NaN where
             the border cuts them, in runs of earlier versions, and without a calibration
    cut      (N, 4) px; left, top, width and height of boxes that the border cuts; NaN of others, and without a
             calibration
    """

    track: Ints
    t: Floats
    seen: Mask
    merged: Mask
    hidden: Mask
    xy: Floats
    sigma: Floats
    margin: Floats
    v: Floats
    speed: Floats
    speed_sigma: Floats
    speed_shared: Floats
    length: Floats
    length_sigma: Floats
    width: Floats
    ahead: Floats
    spread: Floats
    edge: Floats
    cut: Floats

    def __len__(self) -> int:
        return len(self.t)

    @classmethod
    def together(cls, parts: Sequence[Rows]) -> Rows:
        """The rows of parts, one after the other."""
        return cls(*(np.concatenate([getattr(part, column.name) for part in parts]) for column in fields(cls)))

    def only(self, chosen: Mask | Ints) -> Rows:
        """The rows of a mask or of indices."""
        return Rows(*(getattr(self, column.name)[chosen] for column in fields(self)))


def off_road(count: int) -> tuple[Floats, ...]:
    """The last ten columns of rows (count,) of which nothing is known on the road: NaN."""
    nothing = np.full((count, 4), np.nan)
    return *(nothing[:, 0] for _ in range(6)), nothing[:, :2], nothing[:, :3], nothing, nothing


_MARGIN = 0.15
"""Share of a vehicle's length, or of its extent in the picture, by which it must pass a gate."""
_FOOT_SIGMA = 0.1
"""In heights of a box: standard deviation of where `foot_of` has the middle of its footprint above its lower edge"""
_USUAL_M = 4.5
"""m; of a vehicle whose length is not known, for this margin"""
_ROUGH_M = 1.0
"""m; standard deviation of positions without a heading, or where the border cuts the box"""
_ONWARD_S = 2.0
"""s; for which a vehicle without a place is taken to keep its velocity"""


class Reader:
    """Reads the recordings of a day, one block after the other; numbers the tracks of all of them from 0.

    grounds  by the size of the picture; None: positions stay in pixels, and there are no speeds. Edges are in pixels of
             the smallest
    """

    def __init__(self, day: Day, grounds: dict[tuple[int, int], Ground | None]) -> None:
        self._day = day
        self._grounds = grounds
        self._size = min(grounds)
        self._latest = np.full((0, 5), np.nan)
        self._numbers: dict[tuple[int, int], int] = {}

    @property
    def names(self) -> tuple[Ints, Ints]:
        """(T,) session and (T,) track_id of each number."""
        pairs = np.array(list(self._numbers), np.int64).reshape(-1, 2)
        return pairs[:, 0], pairs[:, 1]

    def __iter__(self) -> Iterator[Rows]:
        roads: dict[int, Footprints] = {}
        for recording in self._day.recordings:
            ground = self._grounds[recording.size]
            wanted, road = _needed(recording.folder, ground), None
            if ground is not None and "x_m" not in wanted:
                road = roads.setdefault(recording.session, Footprints(ground, recording.size))
            pictures = whole_pictures(blocks(recording.folder, wanted), recording.folder)
            ready = (self._rows(table, recording, ground, road) for table in pictures)
            with closing(ReadAhead(ready, depth=1)) as ahead:
                yield from ahead

    def _rows(self, table: pa.Table, recording: Recording, ground: Ground | None, road: Footprints | None) -> Rows:
        column, box = numbers_of(table), side_by_side(table, BOX)
        track = self._numbered(table, recording.session)
        seen, merged = states(table)
        t = column["time_s"] + recording.offset_s
        if ground is None:
            xy, wide, high = foot_of(box), box[:, 2], box[:, 3]
            sigma = np.sqrt((column["sigma_x_px"] ** 2 + column["sigma_y_px"] ** 2 + (_FOOT_SIGMA * high) ** 2) / 2)
            margin = _MARGIN * (wide + high) / 2
            v = np.column_stack([column["vx_px_s"], column["vy_px_s"]])
            return Rows(track, t, seen, merged, merged, xy, sigma, margin, v, *off_road(len(t)))
        if road is not None:
            column |= _stand(road, track, column, box, edges(table), merged, recording.rim_px)
        edge = uncut_edges(table, recording.size)
        if recording.size != self._size:
            edge = (edge + 0.5) * (self._size[0] / recording.size[0]) - 0.5
        rows = _on_road(ground, column, track, t, seen, merged, box, edge, cut_ones(box, recording.size))
        make_room(self._latest, len(self._numbers), np.nan)
        _go_on(track, t, np.isnan(column["x_m"]), seen & ~merged, rows.v, rows.xy, self._latest)
        return rows

    def _numbered(self, table: pa.Table, session: int) -> Ints:
        """(N,) numbers over the whole day."""
        ids = table["track_id"].combine_chunks().dictionary_encode()
        known = [self._numbers.setdefault((session, one), len(self._numbers)) for one in ids.dictionary.to_pylist()]
        return np.array(known, np.int64)[ids.indices.to_numpy(zero_copy_only=False)]


class LiveReader:
    """Reads the tables of vehicles that are still tracked, with ROAD_COLUMNS, one after the other in order of time.

    The numbers of tracks are their ids, and no edges are known, nor which boxes the border cuts.
    """

    def __init__(self, ground: Ground) -> None:
        self._ground = ground
        self._latest: dict[int, Floats] = {}

    def read(self, table: pa.Table) -> Rows:
        """The rows of the next table; vehicles without a place are carried as in `Reader`."""
        column = numbers_of(table.select(ROAD_COLUMNS))
        track, t, unknown = table["track_id"].to_numpy(), column["time_s"], np.full((len(table), 4), np.nan)
        rows = _on_road(self._ground, column, track, t, *states(table), side_by_side(table, BOX), unknown, unknown)
        if len(t) == 0:
            return rows
        ids, number = np.unique(track, return_inverse=True)
        nothing = np.full(5, np.nan)
        latest = np.array([self._latest.get(one, nothing) for one in ids.tolist()])
        _go_on(number, t, np.isnan(column["x_m"]), rows.seen & ~rows.merged, rows.v, rows.xy, latest)
        known = self._latest | dict(zip(ids.tolist(), latest, strict=True))
        self._latest = {one: last for one, last in known.items() if t[-1] - last[0] < _ONWARD_S}
        return rows


def numbers_of(table: pa.Table) -> dict[str, Floats]:
    """(N,) of each column of numbers, but for those that lie side by side."""
    apart = {"track_id", "status", *BOX, *EDGE_COLUMNS}
    return {name: numbers(table, name) for name in table.column_names if name not in apart}


def states(table: pa.Table) -> tuple[Mask, Mask]:
    """(N,) whether the picture shows the track, and whether it shares a blob with others."""
    status = table["status"].combine_chunks().dictionary_encode()
    words = status.dictionary.to_pylist()
    code = status.indices.to_numpy(zero_copy_only=False)
    seen = np.array([word != _NOT_SEEN for word in words], bool)[code]
    return seen, np.array([word == "merged" for word in words], bool)[code]


def _on_road(
    ground: Ground,
    column: dict[str, Floats],
    track: Ints,
    t: Floats,
    seen: Mask,
    merged: Mask,
    box: Floats,
    edge: Floats,
    at_border: Floats,
) -> Rows:
    """Rows with a calibration, from the columns of the road."""
    speed, own, shared = (column[name] / 3.6 for name in ("speed_kmh", "speed_sigma_kmh", "speed_shared_sigma_kmh"))
    xy, sigma, spread, ahead, v, margin = _laid_out(
        *(column[name] for name in ("x_m", "y_m", "sigma_x_m", "sigma_y_m", "corr_xy_m", "heading_deg", "length_m")),
        speed,
    )
    _place_roughly(ground, box, xy, sigma)
    hidden, state = partly_hidden(t, box, merged), (xy, sigma, margin, v, speed, own, shared)
    sides = column["length_m"], column["length_sigma_m"], column["width_m"]
    return Rows(track, t, seen, merged, hidden, *state, *sides, ahead, spread, edge, at_border)


@kernel
def _laid_out(
    x: Floats, y: Floats, sigma_x: Floats, sigma_y: Floats, corr: Floats, heading: Floats, length: Floats, speed: Floats
) -> tuple[Floats, Floats, Floats, Floats, Floats, Floats]:
    """xy, sigma, spread, ahead, v and margin of `Rows`, of columns (N,); `heading` in degrees."""
    rows = len(x)
    xy, spread, ahead, v = np.empty((rows, 2)), np.empty((rows, 3)), np.empty((rows, 2)), np.empty((rows, 2))
    sigma, margin = np.empty(rows), np.empty(rows)
    for i in range(rows):
        xy[i, 0], xy[i, 1] = x[i], y[i]
        sx, sy, angle = sigma_x[i], sigma_y[i], np.radians(heading[i])
        spread[i, 0], spread[i, 1], spread[i, 2] = sx * sx, sy * sy, corr[i] * sx * sy
        sigma[i] = np.sqrt((sx * sx + sy * sy) / 2)
        ahead[i, 0], ahead[i, 1] = np.sin(angle), np.cos(angle)
        v[i, 0], v[i, 1] = speed[i] * ahead[i, 0], speed[i] * ahead[i, 1]
        margin[i] = _MARGIN * (_USUAL_M if np.isnan(length[i]) else length[i])
    return xy, sigma, spread, ahead, v, margin


def _needed(folder: Path, ground: Ground | None) -> tuple[str, ...]:
    """The columns to read. Raises ConfigError for a table without them."""
    names = column_names(folder)
    _demand(folder, names, (*_ALWAYS, *_PICTURE), "is not a run over video")
    if ground is None:
        return *_ALWAYS, *_PICTURE
    of_edges = EDGE_COLUMNS if set(EDGE_COLUMNS) <= names else ()
    if set(_ROAD) <= names and _of_this_site(folder, ground):
        return *ROAD_COLUMNS, *of_edges
    _demand(folder, names, _STATE, "has no metres of this site, and they cannot be computed")
    return *_ALWAYS, *_STATE, *of_edges


def _demand(folder: Path, names: set[str], needed: tuple[str, ...], what: str) -> None:
    missing = [name for name in needed if name not in names]
    if missing:
        raise ConfigError(f"{folder} {what}: its table has no column {missing[0]}; track the video again")


def _of_this_site(folder: Path, ground: Ground) -> bool:
    """Whether the metres of a run are where the site has them: at the lower half of the boxes."""
    for table in blocks(folder, ("x_m", "y_m", *BOX)):
        left, top, width, height = (numbers(table, name) for name in BOX)
        x, y = ground.pixels(np.column_stack([numbers(table, "x_m"), numbers(table, "y_m")])).T
        known = np.isfinite(x)
        if known.any():
            held = (x > left) & (x < left + width) & (y > top + height / 4) & (y < top + height)
            return bool(np.mean(held[known]) > 1 / 2)
    return True


def edges(table: pa.Table) -> Floats | None:
    """(N, 4) left, top, right and lower edges that were seen [px]; None in runs of earlier versions."""
    return side_by_side(table, EDGE_COLUMNS) if EDGE_COLUMNS[0] in table.column_names else None


def uncut_edges(table: pa.Table, size: tuple[int, int]) -> Floats:
    """(N, 4) those that the border of the picture does not cut; NaN of others, and where none are known."""
    edge = edges(table)
    return np.full((len(table), 4), np.nan) if edge is None else uncut(edge, size)


def _place_roughly(ground: Ground, box: Floats, xy: Floats, sigma: Floats) -> None:
    """Place those that have no position on the road: xy (N, 2) m, sigma (N,) m; box (N, 4) px.

    The calibration is not sure there, or the border cuts the box. The middle of a footprint that points anywhere stands
    in: good enough to tell the side of a gate.
    """
    rough = np.flatnonzero(np.isnan(xy[:, 0]))
    if len(rough):
        with np.errstate(invalid="ignore", divide="ignore"):
            middle, _ = footprint(ground, box[rough], np.full((len(rough), 2), np.nan), 0.0)
            xy[rough] = ground.metres(middle)
        sigma[rough] = _ROUGH_M


@kernel
def _go_on(track: Ints, t: Floats, rough: Mask, alone: Mask, v: Floats, xy: Floats, latest: Floats) -> None:
    """Put vehicles that were known until just now, in rows without a place, where their velocity (N, 2) has led them,
    as long as they are seen alone.

    latest  (T, 5) of each track the time, place and velocity that were known last
    """
    for i in range(len(track)):
        k = track[i]
        if not alone[i]:
            latest[k, 0] = np.nan
        elif not rough[i]:
            latest[k, 0], latest[k, 1], latest[k, 2] = t[i], xy[i, 0], xy[i, 1]
            latest[k, 3], latest[k, 4] = v[i, 0], v[i, 1]
        elif t[i] - latest[k, 0] < _ONWARD_S and not np.isnan(latest[k, 3]):
            xy[i, 0] = latest[k, 1] + (t[i] - latest[k, 0]) * latest[k, 3]
            xy[i, 1] = latest[k, 2] + (t[i] - latest[k, 0]) * latest[k, 4]


def _stand(
    road: Footprints,
    track: Ints,
    column: dict[str, Floats],
    box: Floats,
    edge: Floats | None,
    merged: Mask,
    rim_px: float,
) -> dict[str, Floats]:
    """The columns of the road, computed from those of the picture, whose boxes have a rim."""
    sigma = np.column_stack([column[f"sigma_{name}"] for name in ("x_px", "y_px", "vx_px_s", "vy_px_s")])
    corr = np.ones((len(track), 4, 4))
    pairs = {"xy": (0, 1), "vxy": (2, 3), "x_vx": (0, 2), "x_vy": (0, 3), "y_vx": (1, 2), "y_vy": (1, 3)}
    for name, (i, j) in pairs.items():
        corr[:, i, j] = corr[:, j, i] = column[f"corr_{name}"]
    P = corr * sigma[:, :, None] * sigma[:, None, :]
    xy, u = (np.column_stack([column[a], column[b]]) for a, b in (("x_px", "y_px"), ("vx_px_s", "vy_px_s")))
    stand = road.place(track, column["time_s"], xy, u, P, box, merged, edge, rim_px)
    own = np.sqrt(np.diagonal(stand.xy_own, axis1=1, axis2=2))
    return {
        "x_m": stand.xy[:, 0],
        "y_m": stand.xy[:, 1],
        "sigma_x_m": own[:, 0],
        "sigma_y_m": own[:, 1],
        "corr_xy_m": correlation(stand.xy_own[:, 0, 1], own.prod(axis=1)),
        "speed_kmh": 3.6 * stand.speed,
        "speed_sigma_kmh": 3.6 * stand.speed_own_sigma,
        "speed_shared_sigma_kmh": 3.6 * np.linalg.norm(stand.speed_by_shared, axis=1),
        "heading_deg": np.degrees(stand.heading),
        "length_m": stand.length,
        "length_sigma_m": stand.length_sigma,
        "width_m": stand.width,
    }
