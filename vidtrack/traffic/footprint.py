"""Where vehicles stand on the road: from their tracks and boxes in the picture to position, speed and length.

The point of a vehicle that a position in metres means is the middle of its footprint: a rectangle on the road, along
the vehicle's heading, `_SLENDER` times as wide as long. In the picture the lower edge of the box is the nearest corner
of this rectangle, and the box is as wide as it, since what stands upright on the road is upright in the picture. With
J [px/m] of the road at the middle, e along and n across the heading, the rectangle of length L reaches

    L / 2 (|J e| + _SLENDER |J n|)

to the left, right, up and down. Its width gives L, and L the middle's height above the lower edge of the box.

A track is at the centroid of a blob, which is not on the road but at some height z, and so moves faster in the picture
than the road under it, by a share of z over the camera's height. In homogeneous coordinates that point is at
(w c + z up), with c the middle of the footprint and w its distance along the camera's axis. Its offset o from c gives
z, and the derivative of its picture point gives velocities, u in the picture and v on the road:

    u = w / (w + z up_w) (J - o grad(w)' / w) v
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays.types import Floats, Ints, Mask
from vidtrack.traffic.boxes import cut, partly_hidden, uncut, within
from vidtrack.traffic.calibration.ground import Ground
from vidtrack.traffic.pace import Pace
from vidtrack.traffic.vehicles.naming import Naming

_SLENDER, _SLENDER_SIGMA = 0.4, 0.1
"""Width over length of vehicles, from motorcycles and cars (0.4) to lorries (0.25), and its standard deviation."""
_WIDEST_M = 2.55
"""m; the widest vehicles on European roads (Directive 96/53/EC)"""
_EDGE_PX = 1.0
"""px; standard deviation of an edge of a box"""
_HIDDEN_SHARE = 0.12
"""Standard deviation of the edges of a box that may not be the whole vehicle's, in sides of the box: set on simulated
roads."""
_OUTLINE_M = 0.3
"""m; standard deviation of a length because the outline of a blob is no footprint's: set on simulated roads"""
_ROUNDS = 3
_SILHOUETTE = 0.02
"""Standard deviation of speeds, as a share, because a centroid is of a silhouette and not one point of the vehicle:
measured for cars by tools/road_plane.py"""
_HEADING_SIGMA = 0.5
"""rad; a heading that is less certain is not used: the last good one of the track stays"""
_ALL_WAYS = 2 / np.pi
"""Mean of |cos|: how far a direction that is not known reaches along an axis."""
_ANY_WAY_SIGMA = float(np.sqrt(np.pi**2 / 8 - 1))
"""Standard deviation of |cos| over its mean."""


@dataclass(frozen=True, slots=True)
class Stand:
    """Vehicles on the road; NaN where the calibration says nothing, or the border cuts the box.

    Errors of two kinds: each vehicle's own, with covariances, and those of the calibration, which all vehicles share,
    as derivatives with respect to eight independent errors of unit variance. With D of two rows, D1 D2' is the
    covariance of their shared errors, and D D' that of one row.

    xy, xy_own, xy_shared   (N, 2), (N, 2, 2), (N, 2, 8) position [m]
    v, v_own, v_shared      (N, 2), (N, 2, 2), (N, 2, 8) velocity [m/s]
    heading                 (N,) of the vehicle, radians clockwise from north; of one that stands, the last one known
    length, length_sigma    (N,) m; NaN without a heading; of one that is partly hidden, those of its track so far
    width                   (N,) m; taken from the length
    kind                    (N,) class by all lengths of the track so far; "" before there is one
    """

    xy: Floats
    xy_own: Floats
    xy_shared: Floats
    v: Floats
    v_own: Floats
    v_shared: Floats
    heading: Floats
    length: Floats
    length_sigma: Floats
    width: Floats
    kind: NDArray[np.str_]

    @property
    def speed(self) -> Floats:
        """(N,) m/s."""
        return np.asarray(np.linalg.norm(self.v, axis=1))

    @property
    def speed_own_sigma(self) -> Floats:
        """(N,) m/s; standard deviation of the vehicle's own error."""
        e = self._ahead()
        return np.asarray(np.sqrt(np.einsum("ni,nij,nj->n", e, self.v_own, e)))

    @property
    def speed_by_shared(self) -> Floats:
        """(N, 8) m/s; the derivative of the speed with respect to the calibration's eight errors."""
        return np.asarray(np.einsum("ni,nik->nk", self._ahead(), self.v_shared))

    def _ahead(self) -> Floats:
        """(N, 2) unit vectors along the velocity; of a vehicle that stands, those of its largest error."""
        speed = self.speed[:, None]
        angle = np.arctan2(2 * self.v_own[:, 0, 1], self.v_own[:, 0, 0] - self.v_own[:, 1, 1]) / 2
        return np.divide(self.v, speed, out=np.column_stack([np.cos(angle), np.sin(angle)]), where=speed > 0)


class Footprints:
    """Places vehicles on the road. Remembers the heading of those that stop; rows must come in order of time.

    ground  the calibrated picture
    size    (width, height) px of the picture, whose border cuts boxes
    classes low and high length of each class of the site [m]; none: those of `classes.CLASSES`
    """

    def __init__(
        self, ground: Ground, size: tuple[int, int], classes: Mapping[str, tuple[float, float]] | None = None
    ) -> None:
        self.ground = ground
        self._naming = Naming(classes or {})
        self._size = size
        self._heading: dict[int, Floats] = {}
        self._pace = Pace()

    def place(
        self,
        track: Ints,
        t: Floats,
        xy: Floats,
        u: Floats,
        P: Floats,
        box: Floats,
        merged: Mask | None = None,
        edge: Floats | None = None,
        rim: Floats | float = 0.0,
    ) -> Stand:
        """The vehicles of N rows, all those of a picture at once.

        track  (N,) identities
        t      (N,) s
        xy, u  (N, 2) positions [px] and velocities [px/s] of the tracks
        P      (N, 4, 4) covariance of (x, y, their velocities)
        box    (N, 4) left, top, width, height [px]
        merged (N,) who shares a blob; None: each box is that of its whole vehicle, also where it touches another
        edge   (N, 4) px left, top, right and lower edges that were seen, NaN where there are none; None: velocities
               follow from u alone
        rim    (N,) px, or one for all; by how much boxes reach beyond vehicles on each side, as outlines of blobs do
        """
        hidden = np.zeros(len(track), bool) if merged is None else partly_hidden(t, box, merged)
        box = np.where(cut(box, self._size)[:, None], np.nan, within(box, rim))
        with np.errstate(invalid="ignore"):
            paced = None if edge is None else self._paced(track, t, edge)
            headings = self._headings(track, xy, u, P, box, paced)
            stand = self._stand(xy, u, P, box, headings[:, :2], headings[:, 2], hidden)
            stand = stand if paced is None else self._at_pace(stand, *paced)
            return self._named(track, stand, hidden)

    def _paced(self, track: Ints, t: Floats, edge: Floats) -> tuple[Floats, Floats]:
        """(N, 2) velocities that were filtered on the road, and (N, 2, 2) their covariances."""
        ground, (left, _, right, bottom) = self.ground, uncut(edge, self._size).T
        foot = ground.metres(ground.inside(np.column_stack([(left + right) / 2, bottom])))
        v, cov = self._pace.follow(track, t, foot, ground.by_own_error(foot))
        return v, cov + _SILHOUETTE**2 * v[:, :, None] * v[:, None, :]

    def _at_pace(self, stand: Stand, v: Floats, cov: Floats) -> Stand:
        """The same with these velocities, where their errors are smaller."""
        ground = self.ground
        better = np.trace(cov, axis1=1, axis2=2) < np.trace(stand.v_own, axis1=1, axis2=2)
        ahead, behind = stand.xy + v / 2, stand.xy - v / 2  # half a second
        shared = ground.by_shared_error(ahead) - ground.by_shared_error(behind)
        return replace(
            stand,
            v=np.where(better[:, None], v, stand.v),
            v_own=np.where(better[:, None, None], cov, stand.v_own),
            v_shared=np.where(better[:, None, None], shared, stand.v_shared),
        )

    def _named(self, track: Ints, stand: Stand, hidden: Mask) -> Stand:
        """The same with classes; who is partly hidden has the length of its track so far, and adds nothing to it."""
        kind, mean, sigma = self._naming.named(track, stand.length, stand.length_sigma, stand.speed, hidden)
        hidden = hidden & np.isfinite(stand.length)
        return replace(
            stand,
            length=np.where(hidden, mean, stand.length),
            length_sigma=np.where(hidden, sigma, stand.length_sigma),
            width=np.where(hidden, np.minimum(_SLENDER * mean, _WIDEST_M), stand.width),
            kind=kind,
        )

    def _stand(self, xy: Floats, u: Floats, P: Floats, box: Floats, e: Floats, e_sigma: Floats, hidden: Mask) -> Stand:
        ground = self.ground
        middle, sides = footprint(ground, box, e, _SLENDER)
        middle = ground.inside(middle)
        sides[np.isnan(middle[:, 0])] = np.nan
        wide = [footprint(ground, box, e, _SLENDER + sign * _SLENDER_SIGMA) for sign in (1, -1)]
        by_shape = (wide[0][0] - wide[1][0]) / 2
        turned = [footprint(ground, box, _turned(e, sign * e_sigma), _SLENDER) for sign in (1, -1)]
        stretched = footprint(ground, box + np.array([0, 0, np.sqrt(2) * _EDGE_PX, 0]), e, _SLENDER)
        length_errors = [(wide[0][1] - wide[1][1]) / 2, (turned[0][1] - turned[1][1]) / 2, stretched[1] - sides]
        foot = np.column_stack([middle[:, 0], box[:, 1] + box[:, 3] - 0.5])
        by_heading = np.where(np.isnan(e), _ANY_WAY_SIGMA * (foot - middle), (turned[0][0] - turned[1][0]) / 2)
        unseen = np.where(hidden[:, None], _HIDDEN_SHARE * box[:, 2:], 0.0)
        edges = (_EDGE_PX**2 + unseen[:, :, None] ** 2) * np.eye(2)
        for error in (by_shape, by_heading):
            edges = edges + error[:, :, None] * error[:, None, :]
        position = ground.metres(middle)
        v, M = velocity(ground, xy, middle, u)
        by_middle = _difference(lambda point: velocity(ground, xy + point - middle, point, u)[0], middle)
        by_offset = _difference(lambda point: velocity(ground, xy, point, u)[0], middle)
        K = ground.by_own_error(position)
        state = np.concatenate([by_middle, M], axis=2)
        pairs = [[_seen_by(one, xy, middle, u) for one in pair] for pair in ground.varied()]
        shared = np.stack([(above - below) / 2 for above, below in pairs], axis=2)
        return Stand(
            xy=position,
            xy_own=K @ (P[:, :2, :2] + edges) @ np.swapaxes(K, 1, 2),
            xy_shared=shared[:, :2],
            v=v,
            v_own=state @ P @ np.swapaxes(state, 1, 2)
            + by_offset @ edges @ np.swapaxes(by_offset, 1, 2)
            + _SILHOUETTE**2 * v[:, :, None] * v[:, None, :],
            v_shared=shared[:, 2:],
            heading=np.where(np.isnan(middle[:, 0]), np.nan, np.arctan2(e[:, 0], e[:, 1])),
            length=sides[:, 0],
            length_sigma=np.hypot(np.linalg.norm(length_errors, axis=0)[:, 0], _OUTLINE_M),
            width=sides[:, 1],
            kind=np.full(len(xy), ""),
        )

    def _headings(
        self, track: Ints, xy: Floats, u: Floats, P: Floats, box: Floats, paced: tuple[Floats, Floats] | None
    ) -> Floats:
        """(N, 3) unit vectors along the vehicles, and the angle's standard deviation; NaN for those that have not
        moved yet. The direction of the tracker's velocity, or of that on the road, whichever is better known; at the
        border, which may cut the box, the centroid goes another way than the vehicle."""
        edges = uncut(np.column_stack([box[:, :2], box[:, :2] + box[:, 2:]]), self._size)
        whole = np.where(np.isfinite(edges).all(axis=1, keepdims=True), box, np.nan)
        middle, _ = footprint(self.ground, whole, np.full((len(box), 2), np.nan), _SLENDER)
        v, M = velocity(self.ground, xy, middle, u)
        found = _direction(v, M @ P[:, 2:, 2:] @ np.swapaxes(M, 1, 2))
        if paced is not None:
            other = _direction(*paced)
            better = other[:, 2] < np.where(np.isnan(found[:, 2]), np.inf, found[:, 2])
            found[better] = other[better]
        found[~(found[:, 2] < _HEADING_SIGMA)] = np.nan
        return self._remembered(track, found)

    def _remembered(self, track: Ints, e: Floats) -> Floats:
        """(N, 3) the headings, or the last one of the same track before."""
        nobody = np.full(3, np.nan)
        ids = np.unique(track)
        known = np.array([self._heading.get(one, nobody) for one in ids.tolist()]).reshape(-1, 3)
        track, e = np.concatenate([ids, track]), np.concatenate([known, e])
        order = np.argsort(track, kind="stable")
        good = np.isfinite(e[order, 0]) | (np.diff(track[order], prepend=-1) != 0)
        last = np.maximum.accumulate(np.where(good, np.arange(len(track)), 0))
        filled = np.empty_like(e)
        filled[order] = e[order[last]]
        ends = order[np.diff(track[order], append=-1) != 0]
        self._heading = dict(zip(track[ends].tolist(), filled[ends], strict=True))
        return filled[len(ids) :]


def footprint(ground: Ground, box: Floats, e: Floats, slender: float) -> tuple[Floats, Floats]:
    """(N, 2) picture points [px] of the middles of the footprints, and (N, 2) their lengths and widths [m].

    box (N, 4), e (N, 2) unit vectors along the vehicles. Where e is NaN the middle is that of a rectangle that points
    anywhere, and its sides are NaN.
    """
    n = np.column_stack([-e[:, 1], e[:, 0]])
    unknown = np.isnan(e[:, :1])
    foot = np.column_stack([box[:, 0] + (box[:, 2] - 1) / 2, box[:, 1] + box[:, 3] - 0.5])
    middle = foot
    for _ in range(_ROUNDS):
        J = ground.px_per_m(ground.metres(middle))
        any_way = _ALL_WAYS * np.linalg.norm(J, axis=2)
        along = np.where(unknown, any_way, np.abs(np.einsum("nij,nj->ni", J, e)))
        across = np.where(unknown, any_way, np.abs(np.einsum("nij,nj->ni", J, n)))
        length = box[:, 2] / (along + slender * across)[:, 0]
        sideways = (slender * length > _WIDEST_M) & (along > across)[:, 0]
        length[sideways] = (box[:, 2] - _WIDEST_M * across[:, 0])[sideways] / along[sideways, 0]
        width = np.minimum(slender * length, _WIDEST_M)
        up = (length * along[:, 1] + width * across[:, 1]) / 2
        middle = foot - np.column_stack([np.zeros(len(up)), up])
    return middle, np.where(unknown, np.nan, np.column_stack([length, width]))


def velocity(ground: Ground, xy: Floats, middle: Floats, u: Floats) -> tuple[Floats, Floats]:
    """(N, 2) velocities on the road [m/s], and (N, 2, 2) their derivatives with respect to those in the picture.

    xy, u   (N, 2) position [px] and velocity [px/s] of a point of each vehicle
    middle  (N, 2) the middles of the footprints [px]
    """
    at = ground.metres(middle)
    straight = ground.straight(xy)
    offset = straight - ground.straight(middle)
    w = ground.depth(at)
    A = ground.straight_px_per_m(at) - offset[:, :, None] * ground.receding / w[:, None, None]
    pose = ground.pose()
    if pose is not None:  # else the camera looks straight down, and what is high does not come nearer along its axis
        A /= _nearer(pose.up, w, straight - offset, offset)[:, None, None]
    if ground.lens is not None:
        A = ground.lens.jacobian(straight) @ A
    M = _inverse(A)
    return np.einsum("nij,nj->ni", M, u), M


def _nearer(up: Floats, w: Floats, middle: Floats, offset: Floats) -> Floats:
    """(N,) (w + z up_w) / w, with z the height of a point that is seen `offset` from the middle of its footprint."""
    lift = up[:2] - up[2] * middle  # the offset is z lift / (w + z up_w)
    along = np.sum(offset * lift, axis=1)
    scale = np.sum(lift**2, axis=1) - up[2] * along
    z = np.divide(w * along, scale, out=np.zeros(len(w)), where=scale != 0)  # right below the camera no height shows
    return np.asarray(1 + z * up[2] / w)


def _seen_by(ground: Ground, xy: Floats, middle: Floats, u: Floats) -> Floats:
    """(N, 4) position and velocity with one calibration."""
    return np.column_stack([ground.metres(middle), velocity(ground, xy, middle, u)[0]])


def _direction(v: Floats, cov: Floats) -> Floats:
    """(N, 3) unit vectors along velocities (N, 2), and the angle's standard deviation by their covariances."""
    speed = np.linalg.norm(v, axis=1)
    e = v / speed[:, None]
    n = np.column_stack([-e[:, 1], e[:, 0]])
    return np.column_stack([e, np.sqrt(np.einsum("ni,nij,nj->n", n, cov, n)) / speed])


def _turned(e: Floats, angle: Floats) -> Floats:
    """(N, 2) the vectors turned by angles (N,)."""
    cos, sin = np.cos(angle)[:, None], np.sin(angle)[:, None]
    return np.asarray(cos * e + sin * np.column_stack([-e[:, 1], e[:, 0]]))


def _inverse(A: Floats) -> Floats:
    """(N, 2, 2) inverses; NaN where there is none."""
    (a, b), (c, d) = np.moveaxis(A, 0, -1)
    det = a * d - b * c
    return np.moveaxis(np.array([[d, -b], [-c, a]]) / np.where(det == 0, np.nan, det), -1, 0)


def _difference(f: Callable[[Floats], Floats], at: Floats, step: float = 0.1) -> Floats:
    """(N, 2, 2) derivative of f (N, 2) at points (N, 2), by central differences of `step` [px]."""
    shifts = step * np.eye(2)
    return np.stack([(f(at + shift) - f(at - shift)) / (2 * step) for shift in shifts], axis=2)
