"""Whether the lengths of a site's sections are those that the calibration gives them."""

from __future__ import annotations

import math

import numpy as np

from vidtrack.arrays.types import Floats
from vidtrack.traffic.calibration.ground import Ground
from vidtrack.traffic.site import Gate, Site

_STEPS = 20
"""Pieces that each segment of a gate is looked at in."""
_SIGMAS = 3.0
_BEND = math.pi / 2
"""Longest way over the straight one: half a circle."""


def section_doubts(site: Site, ground: Ground) -> list[str]:
    """Words about each section whose length is no way from one gate to the other by the calibration.

    A way is at least as long as the shortest distance of the two gates, and bends by half a circle at most. Errors are
    those of the calibration and of the picture points.
    """
    said = []
    for name, section in site.sections.items():
        with np.errstate(invalid="ignore"):
            a, b = (ground.metres(_points(site.gates[gate])) for gate in (section.from_gate, section.to_gate))
        if not (np.isfinite(a).all() and np.isfinite(b).all()):  # above the horizon, which measure refuses
            continue
        (near, near_sigma), (far, far_sigma) = _apart(ground, a, b)
        if not near - _SIGMAS * near_sigma <= section.length_m <= _BEND * (far + _SIGMAS * far_sigma):
            said.append(
                f"sections.{name}.length_m = {section.length_m:g}, but by the calibration the gates are {near:.1f} to "
                f"{far:.1f} m apart; check both; speeds are by the calibration"
            )
    return said


def _apart(ground: Ground, a: Floats, b: Floats) -> tuple[tuple[float, float], tuple[float, float]]:
    """The shortest and the longest distance of points (N, 2) and (M, 2), and their standard deviations [m]."""
    distance = np.linalg.norm(a[:, None] - b, axis=2)
    found = []
    for k in (int(distance.argmin()), int(distance.argmax())):
        ends = np.stack([a[k // len(b)], b[k % len(b)]])
        e = (ends[1] - ends[0]) / max(float(distance.flat[k]), 1e-9)
        shared = ground.by_shared_error(ends)
        own = ground.sigma_px * np.linalg.norm(e @ ground.by_own_error(ends), axis=1)
        sigma = float(np.hypot(np.linalg.norm(e @ (shared[1] - shared[0])), np.linalg.norm(own)))
        found.append((float(distance.flat[k]), sigma))
    return found[0], found[1]


def _points(gate: Gate) -> Floats:
    """(N, 2) points along a gate [px]."""
    line = np.array(gate.line)
    inner = line[:-1, None] + (np.arange(_STEPS) / _STEPS)[:, None] * np.diff(line, axis=0)[:, None]
    return np.vstack([inner.reshape(-1, 2), line[-1]])
