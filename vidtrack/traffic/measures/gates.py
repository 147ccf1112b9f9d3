"""The gates of a site where vehicles are: on the road with a calibration, else in the picture."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vidtrack.arrays.types import Floats, Ints, Mask
from vidtrack.errors import ConfigError
from vidtrack.traffic.calibration.ground import Ground
from vidtrack.traffic.lines import Line
from vidtrack.traffic.polyline import turn
from vidtrack.traffic.site import Gate, Site

_LENS_STEPS = 8
"""Pieces of a gate's segment on the road where a lens bends it"""
_NEAR_PX = 0.5
"""px; beside the middle of a gate, to see which side of it lies where on the road"""
_OFF = 0.05
"""of a gate's length; so far beside it the middle of all entries and exits must lie to tell its inner side"""


@dataclass(frozen=True, slots=True, eq=False)
class Gates:
    """G gates of S segments in all.

    names, legs, roles   (G,)
    segment    (S, 4) x1, y1, x2, y2 in metres or pixels
    begin      (S,) distance of the segment's first end along its gate, in the same unit
    first      (G + 1,) segment at which each gate begins
    directions (G,) names of passing to the side of a gate where `polyline.turn` is negative, and to the other one
    """

    names: tuple[str, ...]
    legs: tuple[str, ...]
    roles: tuple[str, ...]
    segment: Floats
    begin: Floats
    first: Ints
    directions: tuple[tuple[str, str], ...]

    def __len__(self) -> int:
        return len(self.names)

    @property
    def leg(self) -> Ints:
        """(G,) numbers of the legs."""
        return np.unique(np.array(self.legs, dtype=str), return_inverse=True)[1]

    @property
    def inward(self) -> Ints:
        """(G,) the side of each gate on which the middle of all entries and exits lies, as `Passed` has it."""
        start, end = self._ends
        return (turn(start, end, self._middle) >= 0).astype(np.int64)

    @property
    def length(self) -> Floats:
        """(G,) lengths of the gates."""
        last = self.first[1:] - 1
        return np.asarray(self.begin[last] + np.linalg.norm(self.segment[last, 2:] - self.segment[last, :2], axis=1))

    def with_beside(self, by: float) -> tuple[Floats, Floats, Ints]:
        """`segment`, `begin` and `first` of these gates, and then of as many that lie at both ends of each."""
        first, last = self.first[:-1], self.first[1:] - 1
        step = self.segment[:, 2:] - self.segment[:, :2]
        more = by * step / np.linalg.norm(step, axis=1)[:, None]
        start, end = self.segment[first, :2], self.segment[last, 2:]
        before, after = np.hstack([start - more[first], start]), np.hstack([end, end + more[last]])
        count = len(self.segment)
        return (
            np.concatenate([self.segment, np.hstack([before, after]).reshape(-1, 4)]),
            np.concatenate([self.begin, np.column_stack([np.full(len(self), -by), self.length]).ravel()]),
            np.concatenate([self.first, count + 2 + 2 * np.arange(len(self))]),
        )

    def place(self, gate: Ints, along: Floats) -> Floats:
        """(N, 2) the places on gates (N,), or beside them, so far along them (N,)."""
        owner = self._owner
        apart = self.begin.max(initial=0) + np.abs(along).max(initial=0) + 1.0  # one axis for all gates
        s = np.searchsorted(self.begin + apart * owner, along + apart * gate, side="right") - 1
        s = np.maximum(s, self.first[gate])  # before the first end
        start, end = self.segment[s, :2], self.segment[s, 2:]
        ahead = (end - start) / np.linalg.norm(end - start, axis=1)[:, None]
        return np.asarray(start + (along - self.begin[s])[:, None] * ahead)

    def nearest(self, xy: Floats, among: Mask | None = None) -> tuple[Ints, Floats, Floats]:
        """(N,) the gates that are nearest to points (N, 2), the places along them, and how far they are.

        among  (G,) the gates that are looked at; None: all
        """
        share, far = self._apart(xy)
        owner, n = self._owner, np.arange(len(xy))
        if among is not None:
            far[:, ~among[owner]] = np.inf
        s = np.argmin(far, axis=1)
        step = self.segment[s, 2:] - self.segment[s, :2]
        return owner[s], self.begin[s] + share[n, s] * np.linalg.norm(step, axis=1), far[n, s]

    def far(self, gate: Ints, xy: Floats) -> Floats:
        """(N,) how far points (N, 2) are from gates (N,)."""
        _, far = self._apart(xy)
        return np.asarray(np.where(self._owner == gate[:, None], far, np.inf).min(axis=1, initial=np.inf))

    def _apart(self, xy: Floats) -> tuple[Floats, Floats]:
        """(N, S) the nearest places to points (N, 2) on each segment, as shares of it, and how far they are."""
        start, step = self.segment[:, :2], self.segment[:, 2:] - self.segment[:, :2]
        share = np.clip(np.einsum("nsi,si->ns", xy[:, None] - start, step) / np.sum(step**2, axis=1), 0, 1)
        return share, np.linalg.norm(xy[:, None] - start - share[..., None] * step, axis=2)

    @property
    def _owner(self) -> Ints:
        """(S,) the gate of each segment."""
        return np.searchsorted(self.first, np.arange(len(self.segment)), side="right") - 1

    def outside(self, gate: Ints, xy: Floats) -> Mask:
        """(N,) whether points (N, 2) lie on the outer side of gates (N,); a gate on the middle of all has none."""
        start, end = self._ends[:, gate]
        return np.asarray(self.sided[gate] & (turn(start, end, self._middle) * turn(start, end, xy) < 0))

    @property
    def sided(self) -> Mask:
        """(G,) whether the middle of all entries and exits lies clearly beside each gate."""
        start, end = self._ends
        long = np.linalg.norm(end - start, axis=1)
        return np.asarray(np.abs(turn(start, end, self._middle)) > _OFF * long**2)

    @property
    def crosses(self) -> bool:
        """Whether entries and exits are of two legs at least, so that a road lies between them."""
        return len(np.unique(self.leg[self.role("entry", "exit", "both")])) > 1

    @property
    def _ends(self) -> Floats:
        """(2, G, 2) the first and the last end of each gate."""
        return np.stack([self.segment[self.first[:-1], :2], self.segment[self.first[1:] - 1, 2:]])

    @property
    def _middle(self) -> Floats:
        """(2,) the middle of the ends of all entries and exits."""
        meant = self.role("entry", "exit", "both")
        return np.asarray(self._ends[:, meant].mean(axis=(0, 1)) if meant.any() else np.zeros(2))

    def ways(self, gate: Ints, side: Ints) -> tuple[Mask, Mask]:
        """(N,) whether passings of gates (N,) to a side (N,) enter, and whether they leave."""
        both, inwards = self.role("both")[gate], self.inward[gate] == side
        return self.role("entry")[gate] | (both & inwards), self.role("exit")[gate] | (both & ~inwards)

    def role(self, *wanted: str) -> Mask:
        """(G,) whether a gate has one of these roles."""
        return np.isin(np.array(self.roles, dtype=str), wanted)


def gates_of(site: Site, ground: Ground | None) -> Gates:
    """None of a site with zones alone. Raises ConfigError for a site with neither, and for a gate that is not on the
    road's plane."""
    if not (site.gates or site.tracked_zones):
        raise ConfigError(
            f"the site {site.camera.name} has no gates and no zones; draw at least one: [gates.NAME] with a line, or "
            "[zones.NAME] with a polygon"
        )
    lines = {name: _on_road(name, gate, ground) for name, gate in site.gates.items()}
    pieces = [np.column_stack([line[:-1], line[1:]]) for line in lines.values()]
    lengths = [np.hypot(*(piece[:, 2:] - piece[:, :2]).T) for piece in pieces]
    return Gates(
        tuple(lines),
        tuple(gate.leg or name for name, gate in site.gates.items()),
        tuple(gate.role for gate in site.gates.values()),
        np.concatenate([np.empty((0, 4)), *pieces]),
        np.concatenate([np.empty(0), *(np.cumsum(length) - length for length in lengths)]),
        np.cumsum([0, *map(len, pieces)]),
        tuple(_directions(name, gate, ground) for name, gate in site.gates.items()),
    )


def _on_road(name: str, gate: Gate, ground: Ground | None) -> Floats:
    """(N, 2) the corners of a gate where vehicles are."""
    line = np.array(gate.line)
    if ground is None:
        return line
    if ground.lens is not None:
        steps = np.arange(_LENS_STEPS) / _LENS_STEPS
        inner = line[:-1, None] + steps[:, None] * np.diff(line, axis=0)[:, None]
        line = np.vstack([inner.reshape(-1, 2), line[-1]])
    with np.errstate(invalid="ignore"):
        road = ground.metres(line)
    if not np.isfinite(road).all():
        raise ConfigError(f"the gate {name} reaches above the horizon of the calibration; draw it on the road")
    return road


def _directions(name: str, gate: Gate, ground: Ground | None) -> tuple[str, str]:
    """Names of passing to the negative side and to the positive one: the way in the picture."""
    (x1, y1), (x2, y2) = gate.line[0], gate.line[-1]
    against, along = Line(name, x1, y1, x2, y2).directions
    ends = np.array([[x1, y1], [x2, y2]])
    normal = np.array([-(y2 - y1), x2 - x1]) / np.hypot(x2 - x1, y2 - y1)
    points = np.vstack([ends, ends.mean(axis=0) + _NEAR_PX * normal])
    if ground is not None:
        points = ground.metres(points)
    return (against, along) if turn(*points) > 0 else (along, against)
