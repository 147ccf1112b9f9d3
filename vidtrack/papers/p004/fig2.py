"""Figure 2: the confidence region of a target that moves to the right; z1 farther but inside, z2 nearer but outside."""

from __future__ import annotations

import numpy as np

from vidtrack.arrays.types import Floats
from vidtrack.associate.gate import Gate
from vidtrack.associate.hard import NN
from vidtrack.associate.problem import Problem
from vidtrack.decision import Decision
from vidtrack.estimate.kalman import KalmanBank
from vidtrack.estimate.motion.velocity import ConstantVelocity
from vidtrack.estimate.sensor import POSITION
from vidtrack.papers import style
from vidtrack.papers.result import Result, Row
from vidtrack.scan import Scan

MODEL = ConstantVelocity(accel=0.8, cross=0.2, warmup=6, heading=0.0)
R = 0.49 * np.eye(2)
UPDATES, COAST = 20, 3  # frames seen, then frames ahead
REGION = 0.95


def reproduce(runs: int | None, seed: int) -> Result:
    """Draw the region of our filter. Deterministic: runs and seed have no effect."""
    zhat, cov = predicted()
    S = cov + R
    along, across = np.sqrt(np.diag(S))
    z = zhat + np.array([[1.7 * along, 0.3 * across], [-0.2 * along, -2.9 * across]])
    scan = Scan(0.0, z, R)
    problems = [Problem.gated(Gate(0.9999, kind), zhat[None], cov[None], scan) for kind in ("euclidean", "mahalanobis")]
    near, region = (problem.pairs for problem in problems)
    chosen = [int(NN().decide(problem).measurement[0]) for problem in problems]
    drawing, (ax,) = style.figure(panel=(6.8, 3.6))
    for probability, alpha in ((0.5, 0.9), (0.8, 0.75), (REGION, 0.6), (0.99, 0.4)):
        style.region(ax, zhat, S, probability, color=style.BLUE, alpha=alpha)
        style.region(ax, zhat, S, probability, fill=True, color=style.BLUE, alpha=0.07, lw=0)
        edge = zhat + np.array([0, across * np.sqrt(-2 * np.log(1 - probability))])
        ax.text(edge[0], edge[1], f"{probability:g}", color=style.BLUE, fontsize=7, ha="center", va="center",
                bbox={"fc": "white", "ec": "none", "pad": 0.6})  # fmt: skip
    style.arrow(ax, zhat - (11.5, 0), zhat - (0.3, 0), style.GREY)
    ax.plot(*zhat, "o", color=style.INK, ms=4)
    ax.text(zhat[0] - 0.3, zhat[1] + 0.35, r"$\hat x$", fontsize=12, color=style.INK, ha="right")
    for i, colour in enumerate((style.GREEN, style.RED)):
        ax.plot([zhat[0], z[i, 0]], [zhat[1], z[i, 1]], color=colour, lw=0.9, ls="--")
        ax.plot(*z[i], "D", color=colour, ms=6)
        says = f"$z_{i + 1}$: {np.sqrt(near.d2[i]):.1f} px, $d^2$ = {region.d2[i]:.1f}"
        ax.text(z[i, 0] + 0.5, z[i, 1] - 0.6, says, color=colour, fontsize=9, va="center")
    ax.set_aspect("equal")
    reach = 3.4 * along
    ax.set(
        xlabel="x (px)", ylabel="y (px)", xlim=(zhat[0] - reach, zhat[0] + reach), ylim=(-3.6 * across, 3.6 * across)
    )
    style.title(
        ax, f"Predicted {COAST} frames ahead: the nearest is z{chosen[0] + 1}, the most probable z{chosen[1] + 1}"
    )
    rows: list[Row] = [
        {
            "measurement": f"z{i + 1}",
            "distance_px": float(np.sqrt(near.d2[i])),
            "d2": float(region.d2[i]),
            f"inside_{REGION:g}_region": int(region.d2[i] <= Gate(REGION).limit(2)),
            "chosen_by_distance": int(chosen[0] == i),
            "chosen_by_region": int(chosen[1] == i),
            "paper": ("farther, chosen by region", "nearer, chosen by distance")[i],
        }
        for i in range(2)
    ]
    agree = "as" if chosen == [1, 0] else "unlike"
    verdict = (
        f"minimum distance takes z{chosen[0] + 1}, the confidence region z{chosen[1] + 1}, {agree} in the paper; the "
        f"region is {along / across:.1f} times as long as wide only because the process noise is elongated along the "
        f"heading."
    )
    return Result(drawing, rows, verdict)


def predicted() -> tuple[Floats, Floats]:
    """Predicted position (2,) and covariance (2, 2) of a target at 2 px/frame, COAST frames after the last update."""
    bank = KalmanBank(MODEL)
    bank.append(np.array([[-2.0 * UPDATES - 2.0 * COAST, 0.0]]), R[None], np.ones(1))
    one = Decision(np.zeros(1, np.int64), np.zeros(1, np.int64), np.zeros(1, np.int64), np.ones(1), np.zeros(1))
    for k in range(1, UPDATES + 1):
        bank.predict(1.0)
        seen = np.array([[2.0 * (k - UPDATES - COAST), 0.0]])
        bank.update(one, Scan(float(k), seen, R), POSITION)
    for _ in range(COAST):
        bank.predict(1.0)
    zhat, cov = bank.predicted_measurement(POSITION)
    return zhat[0], cov[0]
