"""Correlations between the errors of tracks that shared measurements."""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import combinations

import numpy as np
from scipy.linalg import block_diag, solve_triangular

from vidtrack.arrays.types import Floats, Ints, Mask
from vidtrack.tracking.unresolved.joint import Joint

STRONGEST = 0.999
"""Largest magnitude of a correlation coefficient."""


@dataclass(slots=True)
class Correlations:
    """Covariances between the states of pairs of tracks; other pairs are independent.

    pair   (Q, 2) ids, the smaller one first
    cross  (Q, s, s) covariance of the first one's positions and velocities [x, vx, y, vy, ...] with the second one's
    """

    pair: Ints = field(default_factory=lambda: np.empty((0, 2), np.int64))
    cross: Floats = field(default_factory=lambda: np.empty((0, 0, 0)))

    STATE = ("pair", "cross")

    def predict(self, dt: float) -> None:
        """Move the states by dt seconds, as nearly constant velocity does."""
        F = np.kron(np.eye(self.cross.shape[1] // 2), [[1.0, dt], [0.0, 1.0]])
        self.cross = F @ self.cross @ F.T

    def joint(self, ids: Ints, x: Floats, P: Floats) -> Joint:
        """The joint state of tracks (k,) with means x (k, s) and covariances P (k, s, s).

        Correlations that P no longer admits, because a track was updated alone meanwhile, are reduced in proportion.
        """
        s = x.shape[1]
        every = np.zeros((x.size, x.size))
        for i, own in enumerate(P):
            every[i * s : (i + 1) * s, i * s : (i + 1) * s] = own
        across = np.zeros((x.size, x.size))
        for i, j in combinations(range(len(ids)), 2):
            block = self._of(ids[i], ids[j], s)
            across[i * s : (i + 1) * s, j * s : (j + 1) * s] = block
            across[j * s : (j + 1) * s, i * s : (i + 1) * s] = block.T
        if not across.any():
            return Joint(x.ravel(), every, s // 2)
        white = block_diag(*(np.linalg.inv(np.linalg.cholesky(own)) for own in P))
        least = float(np.linalg.eigvalsh(white @ across @ white.T)[0])
        return Joint(x.ravel(), every + across * min(1.0, STRONGEST / max(-least, STRONGEST)), s // 2)

    def keep(self, ids: Ints, joint: Joint, P: Floats) -> None:
        """Set the correlations of tracks (k,) to those of their joint state; P (k, s, s) are their covariances now.

        The correlation coefficients are kept where P differs from the joint state's, as it does in an IMM.
        """
        s = P.shape[1]
        root = np.linalg.cholesky(P)
        own = [slice(i * s, (i + 1) * s) for i in range(len(ids))]
        scaled = [
            root[i] @ solve_triangular(np.linalg.cholesky(joint.P[k, k]), np.eye(s), lower=True)
            for i, k in enumerate(own)
        ]
        for i, j in combinations(np.argsort(ids), 2):
            self.drop((self.pair == (ids[i], ids[j])).all(axis=1))
            block = scaled[i] @ joint.P[own[i], own[j]] @ scaled[j].T
            self.pair = np.concatenate([self.pair, [[ids[i], ids[j]]]])
            self.cross = np.concatenate([self.cross.reshape(-1, s, s), block[None]])

    def of(self, ids: tuple[int, int]) -> Correlations:
        """Those of two tracks, as tracks 0 and 1."""
        at = (self.pair == ids).all(axis=1)
        return Correlations(np.array([[0, 1]])[: at.sum()], self.cross[at].copy())

    def set(self, ids: tuple[int, int], other: Correlations) -> None:
        """Set those of two tracks to what tracks 0 and 1 have in `other`."""
        self.drop((self.pair == ids).all(axis=1))
        if len(other.pair):
            self.pair = np.concatenate([self.pair, [ids]])
            self.cross = np.concatenate([self.cross.reshape(-1, *other.cross.shape[1:]), other.cross])

    def has(self, ids: Ints) -> bool:
        """Whether two tracks (2,) are correlated."""
        return bool((self.pair == np.sort(ids)).all(axis=1).any())

    def drop(self, gone: Mask) -> None:
        """Forget pairs (Q,)."""
        self.pair, self.cross = self.pair[~gone], self.cross[~gone]

    def _of(self, one: int, other: int, s: int) -> Floats:
        """Covariance (s, s) of track `one` with `other`."""
        at = np.flatnonzero((self.pair == (min(one, other), max(one, other))).all(axis=1))
        if not len(at):
            return np.zeros((s, s))
        return self.cross[at[0]] if one < other else self.cross[at[0]].T
