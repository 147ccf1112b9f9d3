"""Draw what every association method does with the same plots: `python tools/draw_methods.py docs/methods.png`.

Two targets approach, go side by side and part again, with misses and clutter; the tracks start from the truth.
"""

from __future__ import annotations

import math
import sys

import numpy as np

import vidtrack as vt
from vidtrack.amplitude.densities import RAYLEIGH, linear, swerling1
from vidtrack.arrays.types import Floats
from vidtrack.papers import style
from vidtrack.tracking.methods import METHODS

SCANS, SIGMA, P_D, CLUTTER, P_FA = 40, 1.0, 0.9, 4e-3, 1e-2
LEFT, RIGHT, LOW, HIGH = -2.0, 42.0, -11.0, 11.0
SEED = 2


def main(path: str) -> None:
    """Write the picture."""
    truth = paths()
    scans = plots(truth, np.random.default_rng(SEED))
    drawing, panels = style.figure(3, math.ceil(len(METHODS) / 3), panel=(4.2, 2.9))
    for ax in panels[len(METHODS) :]:
        ax.set_axis_off()
    for ax, (name, method) in zip(panels, METHODS.items(), strict=False):
        for scan in scans:
            ax.plot(*scan.z.T, ".", color=style.FAINT, ms=3)
        for target in truth:
            ax.plot(*target.T, color=style.GREY, lw=1.0, ls=":")
        for colour, track in zip((style.BLUE, style.RED), follow(method, truth, scans), strict=True):
            ax.plot(*track.T, color=colour, lw=1.5)
        style.title(ax, name)
        ax.set(xlim=(LEFT, RIGHT), ylim=(LOW, HIGH), xticks=[], yticks=[])
    drawing.savefig(path)


def paths() -> Floats:
    """(2, SCANS, 2) true positions: side by side, 4 sigma apart, in the middle third."""
    x = np.arange(SCANS, dtype=float)
    away = np.maximum(np.abs(x - SCANS / 2) - SCANS / 6, 0.0)
    y = 2.0 + 0.5 * away
    return np.stack([np.column_stack([x, y]), np.column_stack([x, -y])])


def plots(truth: Floats, rng: np.random.Generator) -> list[vt.Scan]:
    """What a radar would see of it, with amplitudes: the targets' at 13 dB, the clutter's Rayleigh."""
    target, area = swerling1(linear(13.0)), (RIGHT - LEFT) * (HIGH - LOW)
    above = RAYLEIGH.threshold(P_FA)
    scans = []
    for k in range(SCANS):
        seen = truth[rng.random(2) < P_D, k] if k else truth[:, k]
        false = rng.uniform([LEFT, LOW], [RIGHT, HIGH], (rng.poisson(CLUTTER * area), 2))
        z = np.concatenate([seen + rng.normal(0, SIGMA, seen.shape), false])
        amplitude = np.concatenate([target.sample(rng, len(seen), above), RAYLEIGH.sample(rng, len(false), above)])
        scans.append(vt.Scan(float(k), z, SIGMA**2 * np.eye(2), amplitude=amplitude))
    return scans


def follow(method: object, truth: Floats, scans: list[vt.Scan]) -> list[Floats]:
    """(k, 2) positions of the two tracks for as long as each lives."""
    tracker = vt.Tracker(
        vt.ConstantVelocity(accel=0.3, speed=1.0), method(), 0.99, vt.LifeCycle(coast_scans=8),
        births=False, detection_probability=P_D, clutter_density=CLUTTER,
    )  # fmt: skip
    velocity = truth[:, 1] - truth[:, 0]
    x = np.column_stack([truth[:, 0, 0], velocity[:, 0], truth[:, 0, 1], velocity[:, 1]])
    ids = tracker.add(0.0, x, np.repeat(np.diag([1.0, 0.1, 1.0, 0.1])[None], 2, axis=0))
    found = [[start] for start in truth[:, 0]]
    for scan in scans[1:]:
        tracks = tracker.step(scan)
        for path, track in zip(found, ids, strict=True):
            path.extend(tracks.xy[tracks.id == track])
    return [np.array(path) for path in found]


if __name__ == "__main__":
    main(*sys.argv[1:])
