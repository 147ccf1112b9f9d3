"""Counting lines: a track counts once per line and direction, however it jitters on the line."""

from __future__ import annotations

import logging
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from vidtrack.arrays.types import Floats, Ints, Mask
from vidtrack.errors import ConfigError
from vidtrack.tracks import Status, Tracks

_log = logging.getLogger(__name__)

_FORMULA = tuple("=+-@\t\r")
_MARGIN = 0.15
"""Share of the vehicle's extent across the line that its position must pass the line by."""
_FOOT = 0.2
"""Where the middle of a footprint is above the lower edge of a box, in heights of it, as far as the box alone tells:
seen from 15 to 40 degrees above the road it is .13 to .35 for a car"""


@dataclass(frozen=True, slots=True)
class Line:
    """A named segment from (x1, y1) to (x2, y2) in source pixels.

    chord  from the first to the last corner of the line that the segment is a part of; None: it is the whole line
    gate   it is of a gate of a site, which vehicles pass where they stand on the road, and not with their middles
    """

    name: str
    x1: float
    y1: float
    x2: float
    y2: float
    chord: tuple[float, float] | None = None
    gate: bool = False

    @property
    def directions(self) -> tuple[str, str]:
        """Names of crossing against and along the normal (-dy, dx): the way in the picture that is nearest.

        A line that lies flatter than 45 degrees is crossed "up" or "down", a steeper one "left" or "right",
        whichever way it was drawn.
        """
        dx, dy = self.chord or (self.x2 - self.x1, self.y2 - self.y1)
        if abs(dx) > abs(dy):
            return ("up", "down") if dx > 0 else ("down", "up")
        return ("right", "left") if dy > 0 else ("left", "right")


def segments(name: str, corners: Sequence[tuple[float, float]]) -> list[Line]:
    """The parts of a gate with two or more corners, over which together a track counts once per direction."""
    (x1, y1), (x2, y2) = corners[0], corners[-1]
    return [Line(name, *start, *end, (x2 - x1, y2 - y1), gate=True) for start, end in pairwise(corners)]


def foot_of(box: Floats) -> Floats:
    """(N, 2) where vehicles stand, as far as their boxes (N, 4), left, top, width, height, tell [px]."""
    left, top, width, height = box.T
    return np.column_stack([left + width / 2, top + (1 - _FOOT) * height])


def parse_line(text: str) -> Line:
    """A line from "NAME:x1,y1,x2,y2". Raises ConfigError."""
    name, _, numbers = text.rpartition(":")
    usage = f"line {text!r}: write it as NAME:x1,y1,x2,y2 in pixels, for example north:0,120,320,120"
    try:
        x1, y1, x2, y2 = (float(number) for number in numbers.split(","))
    except ValueError:
        raise ConfigError(usage) from None
    if name[:1] in _FORMULA:
        raise ConfigError(
            f"line {text!r}: a name that begins with {name[0]} is a formula to spreadsheets; choose another"
        )
    if not name or set(name) & set(',"\n') or not np.isfinite([x1, y1, x2, y2]).all():
        raise ConfigError(usage)
    if (x1, y1) == (x2, y2):
        raise ConfigError(f"line {text!r} has no length: its two ends are the same point")
    return Line(name, x1, y1, x2, y2)


def parse_lines(texts: Sequence[str], width: int, height: int, *, refuse: bool = False) -> list[Line]:
    """Lines from "NAME:x1,y1,x2,y2"; warns of those that no vehicle can cross in a width x height picture.

    refuse  such a line, in place of the warning: the size is not estimated. Raises ConfigError for it, for a malformed
            line and a name that is used twice
    """
    lines = [parse_line(text) for text in texts]
    for name, uses in Counter(line.name for line in lines).items():
        if uses > 1:
            raise ConfigError(f"{uses} lines are called {name!r}; give each its own name")
    for line in lines:
        if not _enters(line, width, height):
            outside = f"line {line.name} lies outside the {width} x {height} picture: nothing can cross it"
            if refuse:
                raise ConfigError(f"{outside}; draw it across the road")
            _log.warning("%s", outside)
    return lines


def _enters(line: Line, width: int, height: int) -> bool:
    """Whether more than a point of a line lies in the picture, outermost pixels included (Liang and Barsky)."""
    begin, end = 0.0, 1.0
    for place, step, last in ((line.x1, line.x2 - line.x1, width - 1), (line.y1, line.y2 - line.y1, height - 1)):
        if step == 0:
            if not 0 <= place <= last:
                return False
            continue
        into, out = sorted((-place / step, (last - place) / step))
        begin, end = max(begin, into), min(end, out)
    return begin < end


@dataclass(frozen=True, slots=True)
class Crossing:
    """A counted crossing: interpolated time, first frame on the new side."""

    time_s: float
    frame: int
    line: str
    direction: str
    track_id: int


class _State:
    """What is remembered of T tracks and L lines; (T,) and (T, L) arrays."""

    def __init__(self, ids: Ints, xy: Floats, distance: Floats, t: float, frame: int) -> None:
        """xy (T, 2, 2): where each track's middle is, and where it stands."""
        shape = distance.shape
        self.id = ids.copy()
        self.xy = xy.copy()
        self.confirmed = np.zeros(len(ids), bool)
        self.distance = distance.copy()  # signed, from the line
        self.side = distance >= 0  # where the track clearly was
        self.counted = np.zeros((*shape, 2), bool)
        self.seen = np.zeros(shape, bool)  # measured since the last change of sign
        self.inside = np.zeros(shape, bool)  # that change was between the segment's ends
        self.time_s = np.full(shape, t)
        self.frame = np.full(shape, frame)

    def replace(self, rows: Ints, old: _State, old_rows: Ints) -> None:
        """Take the memory of tracks that were there before."""
        for name, values in vars(old).items():
            getattr(self, name)[rows] = values[old_rows]

    def keep(self, columns: Sequence[int], old: _State, old_columns: Sequence[int]) -> None:
        """Take the memory of the same tracks at lines that were there before."""
        self.confirmed = old.confirmed
        for name in ("distance", "side", "counted", "seen", "inside", "time_s", "frame"):
            getattr(self, name)[:, columns] = getattr(old, name)[:, old_columns]


class LineCounter:
    """Counts tracks over lines by their position (the centroid, not a corner of the box), over gates of a site by where
    they stand.

    The position must pass the line by a margin relative to the vehicle's extent, or be seen last beyond the
    line (a line near the border). Tentative tracks count once confirmed, and a track that coasted over the
    line once it is found again, both at the time they crossed, interpolated between the scans.
    """

    def __init__(self, lines: Sequence[Line]) -> None:
        self._set(lines)
        empty = np.empty((0, len(lines)))
        self._state = _State(np.empty(0, np.int64), np.empty((0, 2, 2)), empty, 0.0, 0)
        self._t, self._frame = 0.0, 0
        self._totals: Counter[tuple[str, str]] = Counter()

    def use(self, lines: Sequence[Line]) -> None:
        """Count over these lines from the last scan on; lines that were there before go on as if nothing happened."""
        old, before = self._state, self.lines
        self._set(lines)
        now = _State(old.id, old.xy, self._distance(old.xy), self._t, self._frame)
        kept = [(new, before.index(line)) for new, line in enumerate(lines) if line in before]
        now.keep([new for new, _ in kept], old, [was for _, was in kept])
        self._state = now

    def _set(self, lines: Sequence[Line]) -> None:
        names = np.array([line.name for line in lines], str)
        self._same = names[:, None] == names  # (L, L) parts of one line
        self._start = np.array([[line.x1, line.y1] for line in lines]).reshape(-1, 2)
        along = np.array([[line.x2, line.y2] for line in lines]).reshape(-1, 2) - self._start
        self._length = np.linalg.norm(along, axis=1)
        self._along = along / self._length[:, None]
        self._normal = np.column_stack([-self._along[:, 1], self._along[:, 0]])
        self._place = np.array([int(line.gate) for line in lines], int)  # (L,) which of two places passes it
        self.lines = list(lines)

    def _distance(self, xy: Floats) -> Floats:
        """(T, L) signed distances of places (T, 2, 2) from the lines."""
        return np.einsum("tld,ld->tl", xy[:, self._place] - self._start, self._normal)

    def totals(self) -> dict[str, dict[str, int]]:
        """Counts so far, by line and direction."""
        return {line.name: {d: self._totals[line.name, d] for d in sorted(line.directions)} for line in self.lines}

    def resume(self, totals: Mapping[str, Mapping[str, int]]) -> None:
        """Go on from earlier counts, by line and direction."""
        self._totals.update({(line, way): count for line, ways in totals.items() for way, count in ways.items()})

    def step(self, frame: int, tracks: Tracks, stand: Floats | None = None) -> list[Crossing]:
        """Crossings that this scan decided, in order of time.

        stand  (T, 2) where the tracks stand [px], NaN or None where only their boxes tell
        """
        old = self._state
        foot = foot_of(tracks.box)
        xy = np.stack([tracks.xy, foot if stand is None else np.where(np.isnan(stand), foot, stand)], axis=1)
        distance = self._distance(xy)
        now = _State(tracks.id, xy, distance, tracks.t, frame)
        _, rows, old_rows = np.intersect1d(tracks.id, old.id, assume_unique=True, return_indices=True)
        now.replace(rows, old, old_rows)
        self._note_sign_changes(now, xy, distance, tracks.t, frame)
        now.xy, now.distance = xy, distance
        now.confirmed |= tracks.status != Status.TENTATIVE
        now.seen |= tracks.seen[:, None]
        extent = np.abs(self._normal) @ np.nan_to_num(tracks.box[:, 2:]).T
        clear = np.abs(distance) > _MARGIN * extent.T
        crossings = self._collect(now, clear) + self._collect_gone(old, tracks.id)
        self._state, self._t, self._frame = now, tracks.t, frame
        return sorted(crossings, key=lambda crossing: crossing.time_s)

    def close(self) -> list[Crossing]:
        """Crossings of tracks that were last seen beyond a line when the video ended."""
        return self._collect_gone(self._state, np.empty(0, np.int64))

    def _note_sign_changes(self, now: _State, xy: Floats, distance: Floats, t: float, frame: int) -> None:
        changed = (distance >= 0) != (now.distance >= 0)
        if not changed.any():
            return
        row, line = np.nonzero(changed)
        before, after = now.distance[row, line], distance[row, line]
        share = before / (before - after)
        start, end = now.xy[row, self._place[line]], xy[row, self._place[line]]
        point = start + share[:, None] * (end - start)
        along = np.einsum("cd,cd->c", point - self._start[line], self._along[line])
        now.inside[row, line] = (along >= 0) & (along <= self._length[line])
        now.time_s[row, line] = self._t + share * (t - self._t)
        now.frame[row, line] = frame
        now.seen[row, line] = False

    def _collect_gone(self, state: _State, alive: Ints) -> list[Crossing]:
        gone = ~np.isin(state.id, alive)
        if not gone.any():
            return []
        return self._collect(state, np.repeat(gone[:, None], len(self.lines), axis=1))

    def _collect(self, state: _State, clear: Mask) -> list[Crossing]:
        """Crossings among the (track, line) pairs whose side is clear."""
        side = state.distance >= 0
        crossed = clear & (side != state.side) & state.seen & state.confirmed[:, None]
        crossings = []
        for row, line in np.argwhere(crossed & state.inside):
            along_normal = int(side[row, line])
            if state.counted[row, line, along_normal]:
                continue
            state.counted[row, self._same[line], along_normal] = True
            direction = self.lines[line].directions[along_normal]
            self._totals[self.lines[line].name, direction] += 1
            crossings.append(
                Crossing(
                    float(state.time_s[row, line]),
                    int(state.frame[row, line]),
                    self.lines[line].name,
                    direction,
                    int(state.id[row]),
                )
            )
        state.side = np.where(crossed, side, state.side)
        return crossings


def counted(line: str, ways: Mapping[str, int]) -> str:
    """A line's counts in words: "ramp: 12 left, 3 right"."""
    return f"{line}: {', '.join(f'{count} {way}' for way, count in ways.items())}" if ways else line
