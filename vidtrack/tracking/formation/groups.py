"""Formation tracking: targets too close together for individual tracks are tracked as groups (paper 001)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any, Literal, NamedTuple

import numpy as np

from vidtrack.arrays.types import Ints
from vidtrack.associate.gate import Gate
from vidtrack.associate.redundancy import linked
from vidtrack.decision import Event
from vidtrack.errors import ConfigError
from vidtrack.scan import Scan
from vidtrack.tracking.formation.members import Members, rows_of
from vidtrack.tracking.tracker import Tracker
from vidtrack.tracks import TENTATIVE, Tracks


@dataclass(frozen=True, slots=True)
class Formation:
    """Rules of group tracking.

    link   px or m; measurements at most this far apart, directly or by way of others, are one group
    merge  px or m; confirmed groups whose centroids are closer become one
    scans  a member counts once it was seen in this many scans in a row; a gap wider than `link` that lasts this many
           scans splits the group
    by     what updates a group: the mean of its measurements, or the mean of its members, each at its measurement or,
           without one, where the group's velocity took it
    """

    link: float
    merge: float
    scans: int = 3
    by: Literal["measurements", "members"] = "members"

    def __post_init__(self) -> None:
        for name in ("link", "merge"):
            if not 0 < getattr(self, name) < np.inf:
                raise ConfigError(f"{name} is {getattr(self, name)}; it must be a finite distance above zero")
        if self.scans < 1:
            raise ConfigError(f"scans is {self.scans}; it must be at least 1")
        if self.by not in ("measurements", "members"):
            raise ConfigError(f"groups are updated by {self.by!r}; choose measurements or members")


class GroupTracks(NamedTuple):
    """Groups after a scan.

    tracks  one row a group: its centroid
    size    (T,) members, those that this scan did not resolve included
    seen    (T,) members that this scan showed
    """

    tracks: Tracks
    size: Ints
    seen: Ints


class GroupTracker:
    """Tracks groups: a Tracker of their centroids, and the members of each.

    rule     Formation
    options  of the Tracker: model, gate, life, ...
    """

    def __init__(self, rule: Formation, **options: Any) -> None:
        self.rule = rule
        self.tracker = Tracker(**options)
        self._near = Gate(distance="euclidean", radius=rule.link)
        self._close = Gate(distance="euclidean", radius=rule.merge)
        none = np.empty(0, np.int64)
        self.members = Members.new(none, np.empty((0, self.tracker.model.dim)), none, False)

    def step(self, scan: Scan) -> GroupTracks:
        """Take one scan of positions and return all groups at its time. Raises ScanError as Tracker does."""
        ahead, before = self.tracker.predict(scan.t), self.tracker.t
        members = self.members.moved(ahead.id, (scan.t - (scan.t if before is None else before)) * ahead.v)
        taken = members.taken(scan, self._near)
        group = members.whose(taken, scan, self._near)
        self.members = members.seen(taken, group, scan, self.rule.scans)
        names, centroids = self._centroids(scan)
        tracks = self.tracker.step(centroids)
        self._follow(tracks, names)
        events = [*tracks.events, *self._merge(tracks), *self._split(scan.t)]
        now = replace(self.tracker.predict(scan.t), events=tuple(events))
        row = rows_of(self.members.group, now.id)
        size, seen = (np.bincount(row, of, len(now)) for of in (self.members.sure, self.members.measurement >= 0))
        return GroupTracks(now, np.maximum(size, 1).astype(np.int64), seen.astype(np.int64))

    def _centroids(self, scan: Scan) -> tuple[Ints, Scan]:
        """The groups (G,) that the scan shows, and a measurement of each.

        R is the mean of the measurements' own over their number n, and more where members are missing: by the
        measurements' mean the members' scatter over n, since it is chance which of them were seen; by the members the
        square of their surprise over n, since a plot may stand for several.
        """
        members = self.members.only(~self.members.doubtful)
        members = members.only(np.isin(members.group, members.group[members.measurement >= 0]))
        names, row = np.unique(members.group, return_inverse=True)
        seen = members.measurement >= 0
        n, size = np.bincount(row[seen], minlength=len(names)), np.bincount(row, minlength=len(names))
        centre = _means(row, members.z, size)
        own, measured = scan.R[members.measurement[seen]], scan.z[members.measurement[seen]]
        doubt = (members.surprise if self.rule.by == "members" else members.z - centre[row])[seen]
        partial = (n < size)[row[seen], None, None]
        R = _means(row[seen], own + partial * doubt[:, :, None] * doubt[:, None, :], n) / n[:, None, None]
        if self.rule.by == "measurements":
            centre = _means(row[seen], measured, n)
        return names, Scan(scan.t, centre, R, noise=scan.noise)

    def _follow(self, tracks: Tracks, names: Ints) -> None:
        """Members go with the track that took their group's measurement; those of groups without a track end."""
        took = tracks.measurement >= 0
        group = self.members.group.copy()
        for name, track in zip(names[tracks.measurement[took]], tracks.id[took], strict=True):
            group[self.members.group == name] = track
        self.members = self.members._replace(group=group).only(np.isin(group, tracks.id))

    def _merge(self, tracks: Tracks) -> Iterator[Event]:
        """Confirmed groups that are close together become one, under the id of the oldest."""
        tracks = tracks.only((tracks.status != TENTATIVE) & np.isin(tracks.id, self.members.group))
        part = linked(Scan(tracks.t, tracks.xy, np.eye(tracks.xy.shape[1])), self._close)
        for first in np.flatnonzero(np.bincount(part, minlength=len(part)) > 1):
            ids = np.sort(tracks.id[part == first])
            inside = np.isin(self.members.group, ids)
            were = tracks.only(rows_of(self.members.group[inside], tracks.id))
            self.members = self.members._replace(group=np.where(inside, ids[0], self.members.group))
            self._restate(ids, ids[0], were, self.members.only(inside))
            reason = f"groups {', '.join(map(str, ids))} are one"
            yield from (Event(tracks.t, int(i), "merge", reason) for i in ids)

    def _split(self, t: float) -> Iterator[Event]:
        """Parts that a gap has kept apart for long enough become groups of their own."""
        self.members, part = self.members.parted(self._near, self.rule.scans)
        now = self.tracker.predict(t)
        for first in np.unique(part[part >= 0]):
            leaving, old = part == first, self.members.group[first]
            was = now.only(now.id == old)
            new = self._restate(np.empty(0, np.int64), None, was, self.members.only(leaving))
            self.members = self.members._replace(group=np.where(leaving, new, self.members.group))
            self.members.apart[leaving] = 0
            self._restate(np.array([old]), old, was, self.members.only(self.members.group == old))
            yield Event(t, int(old), "split", f"{leaving.sum()} members went apart as group {new}")

    def _restate(self, ids: Ints, name: int | None, were: Tracks, members: Members) -> int:
        """Replace the groups of these ids by one, and return its id: `name`, or a new one for None.

        It is at the mean of its members, with the mean motion of the groups `were` that they came from.
        """
        x, P = were.x.mean(axis=0), were.P.mean(axis=0)
        x[list(were.position)] = members.z.mean(axis=0)
        self.tracker.remove(ids)
        given = None if name is None else np.array([name])
        return int(self.tracker.add(were.t, x[None], P[None], ids=given)[0])


def _means(row: Ints, values: np.ndarray, count: Ints) -> np.ndarray:
    """Means of values (N, ...) over the rows (N,) that they belong to, `count` of them in each."""
    total = np.zeros((len(count), *values.shape[1:]))
    np.add.at(total, row, values)
    return total / count.reshape(-1, *(1,) * (values.ndim - 1))
