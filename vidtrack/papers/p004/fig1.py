"""Figure 1: a measurement nearer to one predicted position, but more probable for the other."""

from __future__ import annotations

import numpy as np

from vidtrack.arrays.types import Floats
from vidtrack.associate.gate import Gate
from vidtrack.papers import style
from vidtrack.papers.result import Result, Row
from vidtrack.scan import Scan

PREDICTED = np.array([[0.0], [6.0]])
SIGMA = np.array([2.4, 0.8])
Z = 3.6


def reproduce(runs: int | None, seed: int) -> Result:
    """Draw two predicted densities and z. Deterministic: runs and seed have no effect."""
    distance, density = compare(Z)
    near, likely = int(distance.argmin()), int(density.argmax())
    drawing, (ax,) = style.figure(panel=(6.4, 3.6))
    x = np.linspace(-8, 10, 600)
    for i, colour in enumerate((style.BLUE, style.RED)):
        curve = np.exp(-0.5 * ((x - PREDICTED[i, 0]) / SIGMA[i]) ** 2) / (SIGMA[i] * np.sqrt(2 * np.pi))
        ax.plot(x, curve, color=colour)
        ax.fill_between(x, curve, color=colour, alpha=0.12, lw=0)
        ax.vlines(PREDICTED[i, 0], 0, curve.max(), color=colour, lw=1, ls=":")
        ax.text(PREDICTED[i, 0], curve.max() + 0.01, rf"$\hat x_{i + 1}$", color=colour, ha="center", fontsize=11)
        ax.plot(Z, density[i], "o", color=colour, ms=5)
        says = f"target {i + 1}: |z - x| = {distance[i]:.1f} px, p(z) = {density[i]:.3f}"
        ax.text(-7.8, 0.44 - 0.05 * i, says, color=colour, fontsize=9)
    ax.axvline(Z, color=style.INK, lw=1, ls="--")
    ax.text(Z + 0.1, 0.53, "z", color=style.INK, fontsize=11)
    ax.set(xlabel="position (px)", ylabel="density (1/px)", ylim=(0, 0.56), xlim=(-8, 10))
    style.title(ax, f"z is nearest to target {near + 1}, most probable for target {likely + 1}")
    rows: list[Row] = [
        {
            "target": i + 1,
            "predicted_px": float(PREDICTED[i, 0]),
            "sigma_px": float(SIGMA[i]),
            "z_px": Z,
            "distance_px": float(distance[i]),
            "density": float(density[i]),
            "nearest": int(i == near),
            "most_probable": int(i == likely),
            "paper": "nearest to x2, more probable for x1",
        }
        for i in range(2)
    ]
    agree = "as" if (near, likely) == (1, 0) else "unlike"
    return Result(
        drawing,
        rows,
        f"z lies nearer to target {near + 1} ({distance[near]:.1f} against {distance[1 - near]:.1f} px) but is "
        f"{density[likely] / density[1 - likely]:.1f} times as probable for target {likely + 1}, {agree} in the "
        f"paper's figure, whose numbers are not given.",
    )


def compare(z: float) -> tuple[Floats, Floats]:
    """Distance and density (2,) of a measurement for both targets, by the tracker's gate."""
    R = np.array([[0.25]])
    cov = (SIGMA**2)[:, None, None] - R
    scan = Scan(0.0, np.array([[z]]), R)
    near = Gate(distance="euclidean").pairs(PREDICTED, cov, scan)
    region = Gate(probability=1.0).pairs(PREDICTED, cov, scan)
    return np.sqrt(near.d2), np.exp(region.log_l)
