"""Redundant measurements: several measurements of one target in a scan are combined before the association."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from vidtrack.arrays.types import Floats, Ints
from vidtrack.associate.clusters import find
from vidtrack.associate.gate import Gate
from vidtrack.compiled import kernel
from vidtrack.estimate.sensor import wrapped
from vidtrack.scan import Scan

BLOCK = 256
"""Measurements that are compared with all others at a time; this bounds the memory."""


def combined(scan: Scan, probability: float = 0.95) -> tuple[Scan, Ints]:
    """The scan with the measurements of each target combined, and (M,) the new index of each old measurement.

    Measurements a and b are linked if (za - zb)' (Ra + Rb)^-1 (za - zb) is at most the chi-square quantile of
    `probability`; linked measurements of one run form a group (single linkage). A group becomes z = R sum(Ri^-1 zi)
    with R = (sum Ri^-1)^-1 (SPEC 001, redundancy elimination), with the bounding box of its boxes, its largest
    amplitude and score, and the label and lasting errors of its first measurement.

    Raises ConfigError for a probability outside 0..1.
    """
    angles = scan.sensor.angles if scan.sensor else ()
    leader, part = np.unique(linked(scan, Gate(probability)), return_inverse=True)
    order = np.argsort(part, kind="stable")
    begin = np.searchsorted(part[order], np.arange(len(leader)))

    information = np.linalg.inv(scan.R)
    away = wrapped(scan.z - scan.z[leader][part], angles)
    R = np.linalg.inv(np.add.reduceat(information[order], begin, axis=0))
    pull = np.add.reduceat((information @ away[:, :, None])[order], begin, axis=0)
    z = wrapped(scan.z[leader] + (R @ pull)[:, :, 0], angles)

    def strongest(values: Floats | None) -> Floats | None:
        return None if values is None else np.maximum.reduceat(values[order], begin)

    return replace(
        scan,
        z=z,
        R=(R + np.swapaxes(R, 1, 2)) / 2,
        box=None if scan.box is None else _around(scan.box, scan.z, z, order, begin),
        amplitude=strongest(scan.amplitude),
        score=strongest(scan.score),
        label=None if scan.label is None else scan.label[leader],
        run=None if scan.run is None else scan.run[leader],
        lasting=None if scan.lasting is None else scan.lasting[leader],
    ), part


def linked(scan: Scan, gate: Gate) -> Ints:
    """(M,) first measurement of each measurement's group; pairs inside a gate are linked (single linkage).

    Measurements of different runs are never linked.
    """
    angles, root = scan.sensor.angles if scan.sensor else (), np.arange(len(scan))
    for first in range(0, len(scan), BLOCK):
        some = slice(first, first + BLOCK)
        run = None if scan.run is None else scan.run[some]
        pairs = gate.pairs(scan.z[some], scan.R[some], scan, run, angles)
        _join(root, pairs.row + first, pairs.measurement)
    return _roots(root)


def _around(box: Floats, place: Floats, z: Floats, order: Ints, begin: Ints) -> Floats:
    """Bounding boxes (K, 4), relative to z (K, m), of groups of boxes (M, 4), relative to their places (M, m)."""
    low = box[:, :2] + place[:, :2]
    high = low + box[:, 2:]
    near = np.minimum.reduceat(low[order], begin, axis=0)
    far = np.maximum.reduceat(high[order], begin, axis=0)
    return np.hstack([near - z[:, :2], far - near])


@kernel
def _join(root: Ints, a: Ints, b: Ints) -> None:
    """Give both members of each pair the smaller of their roots."""
    for k in range(len(a)):
        i, j = find(root, a[k]), find(root, b[k])
        root[max(i, j)] = min(i, j)


@kernel
def _roots(root: Ints) -> Ints:
    """(M,) root of each element."""
    return np.array([find(root, i) for i in range(len(root))], np.int64)
