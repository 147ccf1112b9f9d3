"""Figure 3: two crossing targets in one frame, swapped by distance and correct by confidence region.

Numbers that can be checked by hand: predictions (0, 0) with S = diag(1, 36), moving up, and (-4, 6) with
S = diag(36, 1), moving right; their measurements (0, 8) and (4, 6). Rotated by 45 degrees both S have equal variances
in x and y: eq. (8) of the paper is then plain distance, and only the full S separates the targets.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from vidtrack.arrays.types import Floats
from vidtrack.associate.gate import Distance, Gate
from vidtrack.associate.hard import GNN, NN
from vidtrack.associate.problem import Problem
from vidtrack.estimate.motion.velocity import ConstantVelocity
from vidtrack.papers import style
from vidtrack.papers.result import Result, Row
from vidtrack.scan import Scan

if TYPE_CHECKING:
    from matplotlib.axes import Axes

PREDICTED = np.array([[0.0, 0.0], [-4.0, 6.0]])
HEADING = np.array([np.pi / 2, 0.0])
MEASURED = np.array([[0.0, 8.0], [4.0, 6.0]])
R = 0.25 * np.eye(2)
# Known exactly a frame ago, the positions are uncertain by the acceleration in between: dt^4 / 4 of its variance.
MODEL = ConstantVelocity(accel=2 * np.sqrt(36 - 0.25), cross=2 * np.sqrt(1 - 0.25))
DISTANCES: tuple[Distance, ...] = ("euclidean", "decoupled", "mahalanobis")
WORDS = {"euclidean": "minimum distance", "decoupled": "confidence region, eq. (8)", "mahalanobis": "full covariance"}


@dataclass(frozen=True, slots=True)
class Frame:
    """Two predictions zhat (2, 2) and their cov (2, 2, 2) without R, headings u (2, 2); z[i] is of target i."""

    zhat: Floats
    cov: Floats
    z: Floats
    u: Floats

    @classmethod
    def turned(cls, angle: float) -> Frame:
        """The case above, rotated about the origin, with the regions of process noise along the heading."""
        c, s = np.cos(angle), np.sin(angle)
        T = np.array([[c, -s], [s, c]])
        u = np.stack([np.cos(HEADING), np.sin(HEADING)], axis=-1) @ T.T
        x = np.stack([np.zeros(2), u[:, 0], np.zeros(2), u[:, 1]], axis=-1)
        Q = MODEL.process_noise(1.0, x, np.zeros((2, 4, 4)), np.full(2, 100), np.ones(2))
        return cls(PREDICTED @ T.T, Q[:, ::2, ::2].copy(), MEASURED @ T.T, u)

    def d2(self, distance: Distance) -> Floats:
        """(2, 2) squared distances of targets (rows) to measurements, by the tracker's gate."""
        return self._problem(distance).pairs.d2.reshape(2, 2)

    def taken(self, distance: Distance, method: type[NN] | type[GNN]) -> list[int]:
        """Measurement of each target, by the tracker's association."""
        return [int(j) for j in method().decide(self._problem(distance)).measurement]

    def _problem(self, distance: Distance) -> Problem:
        return Problem.gated(Gate(1.0, distance), self.zhat, self.cov, Scan(0.0, self.z, R))


def reproduce(runs: int | None, seed: int) -> Result:
    """The case above by our gate and association. Deterministic: runs and seed have no effect."""
    frames = {"axis-aligned": Frame.turned(0.0), "turned by 45 degrees": Frame.turned(np.pi / 4)}
    drawing, panels = style.figure(3, 2, panel=(3.9, 3.7))
    rows: list[Row] = []
    for i, (name, frame) in enumerate(frames.items()):
        for j, distance in enumerate(DISTANCES):
            _panel(panels[3 * i + j], frame, distance, name)
            d2 = frame.d2(distance)
            rows.append(
                {
                    "case": name,
                    "distance": WORDS[distance],
                    **{f"d2_target{t + 1}_z{k + 1}": float(d2[t, k]) for t in (0, 1) for k in (0, 1)},
                    "nn": _outcome(frame.taken(distance, NN)),
                    "gnn": _outcome(frame.taken(distance, GNN)),
                    "paper": {"euclidean": "swap", "decoupled": "correct"}.get(distance, "left as future work")
                    if i == 0
                    else "not considered",
                }
            )
    outcome = {(row["case"], row["distance"]): row["gnn"] for row in rows}
    aligned, turned = ([outcome[name, WORDS[d]] for d in DISTANCES] for name in frames)
    verdict = (
        f"axis-aligned: minimum distance {aligned[0]}, eq. (8) {aligned[1]}, full covariance {aligned[2]} (the paper: "
        f"swap, correct); turned by 45 degrees: {turned[0]}, {turned[1]}, {turned[2]}, since eq. (8) is then plain "
        f"distance."
    )
    return Result(drawing, rows, verdict)


def _outcome(taken: list[int]) -> str:
    return "correct" if taken == [0, 1] else "swap" if taken == [1, 0] else "merge"


def _panel(ax: Axes, frame: Frame, distance: Distance, case: str) -> None:
    """Draw regions, measurements and the association."""
    taken = frame.taken(distance, GNN)
    colours = (style.BLUE, style.ORANGE)
    for t in (0, 1):
        S, zhat, u = frame.cov[t] + R, frame.zhat[t], frame.u[t]
        shape = {"euclidean": np.trace(S) / 2 * np.eye(2), "decoupled": np.diag(np.diag(S))}.get(distance, S)
        for probability in (0.5, 0.86):
            style.region(ax, zhat, shape, probability, color=colours[t], alpha=0.55)
        style.arrow(ax, zhat - 7 * u, zhat - 0.6 * u, colours[t])
        ax.plot(*zhat, "o", color=colours[t], ms=5)
        right = taken[t] == t
        link = style.GREEN if right else style.RED
        style.arrow(ax, zhat, frame.z[taken[t]], link, ls="-" if right else "--", lw=1.6, shrinkA=3, shrinkB=5)
        ax.plot(*frame.z[t], "D", color=style.INK, ms=5)
        ax.text(frame.z[t, 0] + 0.7, frame.z[t, 1] + 0.5, f"$z_{t + 1}$", fontsize=10, color=style.INK)
    swapped = taken != [0, 1]
    style.title(ax, f"{case}\n{WORDS[distance]}: {_outcome(taken)}", style.RED if swapped else style.INK)
    ax.set_aspect("equal")
    middle = frame.zhat.mean(axis=0)
    ax.set(
        xlim=(middle[0] - 14.5, middle[0] + 14.5),
        ylim=(middle[1] - 14.5, middle[1] + 14.5),
        xlabel="x (px)",
        ylabel="y (px)",
    )
