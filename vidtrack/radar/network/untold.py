"""What is not known of the biases, in the errors of tracks.

A filter takes the errors of plots as independent, and averages them. A bias is in all plots of a radar alike and does
not average, so its error is in a track at full size: in Schmidt's terms it is considered, not estimated (S. F. Schmidt,
"Application of state-space methods to navigation problems", Advances in Control Systems 3, 1966). Where several radars
see a target, each has the share in its track that the information of its plots has.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from vidtrack.arrays.types import Floats
from vidtrack.radar.network.registration import Registration, derivatives, in_plane
from vidtrack.tracks import Tracks

OUTSIDE = 1e-6
"""Share of its plots that a radar has outside its coverage: there tracks coast with the biases of all radars."""

LEAST_M = 1e-3
"""m; standard deviation of a position beside the radar's errors, which are none at its own place."""


def with_untold(tracks: Tracks, registration: Registration, covered: Sequence[Floats], R: Floats) -> Tracks:
    """The tracks with what is not known of the biases in the covariances of their positions and velocities.

    covered  for each of S radars (T,) the share of its coverage where the tracks are
    R        (S, 2, 2) covariances of range and azimuth of each radar's plots
    """
    J, information = [], []
    for k, origin in enumerate(registration.origins):
        position = derivatives(origin, tracks.xy, tracks.v)
        J.append(np.stack([position, _of_velocities(origin, tracks.xy, tracks.v)], axis=1))
        rate = (covered[k] + OUTSIDE) / registration.scan_s[k]
        errors = in_plane(position, R[k] + registration.of(k)[1][:2, :2]) + LEAST_M**2 * np.eye(2)
        information.append(rate[:, None, None] * np.linalg.inv(errors))
    whole = np.linalg.inv(sum(information))
    H = np.concatenate([(whole @ own)[:, None] @ by for own, by in zip(information, J, strict=True)], axis=3)
    H = H.reshape(len(tracks), 4, -1)
    columns = [*tracks.position, *tracks.velocity]
    untold = np.zeros_like(tracks.P)
    untold[np.ix_(range(len(tracks)), columns, columns)] = H @ registration.cov @ H.transpose(0, 2, 1)
    prior_P = None if tracks.prior_P is None else tracks.prior_P + untold
    return replace(tracks, P=tracks.P + untold, prior_P=prior_P)


def _of_velocities(origin: Floats, xy: Floats, v: Floats) -> Floats:
    """(N, 2, KINDS) derivatives of the velocities of targets by the biases: those of their positions in time."""
    away = xy - origin
    r = np.maximum(np.linalg.norm(away, axis=1, keepdims=True), 1.0)
    unit = away / r
    across = v - unit * np.sum(unit * v, axis=1, keepdims=True)
    return np.stack([across / r, np.column_stack([v[:, 1], -v[:, 0]]), np.zeros_like(v)], axis=2)
