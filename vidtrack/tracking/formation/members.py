"""Members of groups: positions, measured or predicted."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from vidtrack.arrays.types import Floats, Ints, Mask
from vidtrack.associate.gate import Gate
from vidtrack.associate.hard import GNN
from vidtrack.associate.problem import Problem
from vidtrack.associate.redundancy import linked
from vidtrack.scan import Scan
from vidtrack.tracking.choices import heaviest


class Members(NamedTuple):
    """Members of all groups, one row each.

    group        (K,) id of its group
    z            (K, d) position
    surprise     (K, d) position minus predicted position
    measurement  (K,) measurement of the last scan; -1 for none
    streak       (K,) number of last scans in a row with a measurement
    sure         (K,) whether it counts as a member
    apart        (K,) scans for which a gap has separated it from the largest part of its group
    """

    group: Ints
    z: Floats
    surprise: Floats
    measurement: Ints
    streak: Ints
    sure: Mask
    apart: Ints

    @classmethod
    def new(cls, group: Ints, z: Floats, measurement: Ints, sure: bool) -> Members:
        """Members (B,) of groups, seen at z (B, d) by these measurements for the first time."""
        count = len(group)
        once, never = np.ones(count, np.int64), np.zeros(count, np.int64)
        return cls(group, z, np.zeros_like(z), measurement, once, np.full(count, sure), never)

    def only(self, rows: Any) -> Members:
        """Those of a mask or of indices."""
        return Members(*(column[rows] for column in self))

    def joined(self, other: Members) -> Members:
        """These members, then the others."""
        return Members(*(np.concatenate(columns) for columns in zip(self, other, strict=True)))

    def moved(self, ids: Ints, shift: Floats) -> Members:
        """Each moved with its group: shift (T, d) of the groups ids (T,)."""
        return self._replace(z=self.z + shift[rows_of(self.group, ids)])

    def taken(self, scan: Scan, near: Gate) -> Ints:
        """(K,) measurement that each takes, no two the same; -1 for none."""
        problem = Problem.gated(near, self.z, np.zeros((*self.z.shape, self.z.shape[1])), scan)
        return heaviest(GNN().decide(problem))

    def whose(self, taken: Ints, scan: Scan, near: Gate) -> Ints:
        """(M,) group of each measurement: that of the member which took it, else of one linked to it, else a new one.

        New groups have numbers below zero.
        """
        part = linked(scan, near)
        group, known = np.full(len(scan), -1), np.zeros(len(scan), bool)
        hit = taken >= 0
        group[taken[hit]], known[taken[hit]] = self.group[hit], True
        joined = np.full(len(scan), -1)
        np.maximum.at(joined, part[known], group[known])
        group[~known] = joined[part[~known]]
        return np.where(group < 0, part - len(scan), group)

    def seen(self, taken: Ints, group: Ints, scan: Scan, scans: int) -> Members:
        """After a scan whose measurements (M,) are of these groups: each where it was seen, else where it went.

        While others of the group are missing, a plot may stand for several. The farther it is from where a member was
        expected, the less the member follows it: by the share of the measurement's variance in the square of that.
        A member seen in `scans` scans in a row counts from then on. One that does not count yet is dropped when it is
        missed, unless no member of its group counts.
        """
        hit, doubtful = taken >= 0, self.doubtful
        surprise, var = np.zeros_like(self.z), np.ones(len(self.z))
        surprise[hit] = scan.z[taken[hit]] - self.z[hit]
        var[hit] = scan.R[taken[hit]].trace(axis1=1, axis2=2)
        lacking = np.isin(self.group, self.group[~hit & ~doubtful])
        follow = np.where(lacking, var / (var + (surprise**2).sum(axis=1)), 1.0)
        streak = np.where(hit, self.streak + 1, 0)
        old = self._replace(
            z=self.z + follow[:, None] * surprise,
            surprise=surprise,
            measurement=taken,
            streak=streak,
            sure=self.sure | (streak >= scans),
        ).only(hit | ~doubtful)
        others = np.setdiff1d(np.arange(len(scan)), taken[hit])
        return old.joined(Members.new(group[others], scan.z[others], others, scans == 1))

    @property
    def doubtful(self) -> Mask:
        """(K,) those that do not count while others of their group do."""
        return ~self.sure & np.isin(self.group, self.group[self.sure])

    def parted(self, near: Gate, scans: int) -> tuple[Members, Ints]:
        """With the gaps inside groups counted, and the part (K,) of each: those that are apart for so many `scans`
        have one, numbered by a row; the others -1."""
        groups, run = np.unique(self.group, return_inverse=True)
        part = linked(Scan(0.0, self.z, np.eye(self.z.shape[1]), run=run), near)
        size = np.bincount(part, self.sure + 1e-6, len(part))
        largest = np.full(len(groups), -1)
        order = np.argsort(size[part], kind="stable")
        largest[run[order]] = part[order]
        off = part != largest[run]
        members = self._replace(apart=np.where(off, self.apart + (self.measurement >= 0), 0))
        longest = np.zeros(len(part), np.int64)
        np.maximum.at(longest, part, np.where(self.sure, members.apart, 0))
        return members, np.where(off & (longest[part] >= scans), part, -1)


def rows_of(ids: Ints, among: Ints) -> Ints:
    """(K,) places of ids (K,) among others (T,), all of which are there."""
    order = np.argsort(among)
    rows: Ints = order[np.searchsorted(among, ids, sorter=order)]
    return rows
