"""Gate and likelihood of tracks whose predicted measurement is a Gaussian mixture: interacting multiple models."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.special import logsumexp

from vidtrack.arrays.rows import starts
from vidtrack.arrays.types import Floats, Ints
from vidtrack.associate.gate import Gate, Pairs
from vidtrack.estimate.bank import Modes
from vidtrack.estimate.kernels import TURN
from vidtrack.estimate.sensor import wrapped
from vidtrack.scan import Scan

LEAST_MODE = 0.01
"""Least probability of a mode that has a gate; the likelihood counts all modes."""


def mixture_pairs(
    gate: Gate,
    modes: Modes,
    scan: Scan,
    run: Ints | None = None,
    angles: tuple[int, ...] = (),
    detection: float | Floats = 0.9,
    clutter: float | Floats = 1e-5,
) -> tuple[Pairs, Floats]:
    """Pairs inside the gate of any mode, and P_G (T,).

    detection, clutter   P_D and clutter density, one for all or (T,)
    log_l  (N,) ln of the sum over the modes of weight N(v; 0, S); cost follows from it
    d2, nis, log_s  of the mode that explains the measurement best
    limit  (T,) the largest of the modes'
    """
    weight, zhat, cov = modes
    count, rows, dim = zhat.shape
    each = [gate.pairs(zhat[j], cov[j], scan, run, angles, detection, clutter, weight[j]) for j in range(count)]
    limit = np.where(weight < LEAST_MODE, 0.0, np.stack([pairs.limit for pairs in each]))
    keys = [
        (pairs.row * len(scan) + pairs.measurement)[own[pairs.row] > 0] for pairs, own in zip(each, limit, strict=True)
    ]
    key = np.unique(np.concatenate(keys))
    row, measurement = key // max(1, len(scan)), key % max(1, len(scan))
    v = np.stack([wrapped(scan.z[measurement] - mean[row], angles) for mean in zhat])
    S = cov[:, row] + scan.R[measurement]
    d2 = np.einsum("rni,rni->rn", v, np.linalg.solve(S, v[..., None])[..., 0])
    log_s = np.linalg.slogdet(S)[1]
    with np.errstate(divide="ignore"):
        log_l = np.log(weight[:, row]) - 0.5 * (d2 + log_s + dim * np.log(TURN))
    best = log_l.argmax(axis=0)
    at = np.arange(len(key))
    total = logsumexp(log_l, axis=0)
    pairs = replace(
        each[0],
        row=row,
        measurement=measurement,
        d2=d2[best, at],
        nis=d2[best, at],
        log_s=log_s[best, at],
        log_l=total,
        cost=-2 * total - dim * np.log(TURN),
        limit=limit.max(axis=0),
        start=starts(row, rows),
    )
    return pairs, _share(gate, modes, limit, scan, angles)


def _share(gate: Gate, modes: Modes, limit: Floats, scan: Scan, angles: tuple[int, ...]) -> Floats:
    """(T,) P_G: the mean over the modes of what the gate that admits most of each mode's measurements admits.

    limit (r, T) the modes' gates. In the gate of mode k a measurement of mode j has the mean squared distance
    tr S_k^-1 (S_j + d d'), with d the difference of their predictions; it is taken as chi-square, scaled to that mean.
    """
    weight, zhat, cov = modes
    S = cov if scan.noise is None else cov + scan.noise
    known, d = np.linalg.inv(S), wrapped(zhat - zhat[:, None], angles)
    mean = np.einsum("ktab,jtab->kjt", known, S) + np.einsum("ktab,kjta,kjtb->kjt", known, d, d)
    dim = zhat.shape[2]
    admitted = gate.inside(limit[:, None] * (dim / mean), dim)
    return np.einsum("jt,jt->t", weight, admitted.max(axis=0))
