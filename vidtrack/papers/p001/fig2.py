"""Figure 2: gates of two close tracks, four observations, and their association."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from vidtrack.associate.gate import Gate
from vidtrack.associate.hard import GNN, NN, GreedyGNN
from vidtrack.associate.problem import Problem
from vidtrack.estimate.motion.velocity import ConstantVelocity
from vidtrack.papers import style
from vidtrack.papers.result import Result, Row
from vidtrack.scan import Scan
from vidtrack.tracking.choices import heaviest
from vidtrack.tracking.deferred.deferred import Deferred
from vidtrack.tracking.deferred.mht import MHT, HypothesisForest
from vidtrack.tracking.deferred.splitting import Split
from vidtrack.tracking.tracker import Tracker

if TYPE_CHECKING:
    from matplotlib.axes import Axes

PREDICTED = np.array([[0.0, 0.0], [3.0, 0.0]])
OBSERVED = np.array([[-1.5, 1.0], [1.2, 0.3], [2.0, -0.4], [9.0, 9.0]])
HALF = 0.5 * np.eye(2)
"""Covariance of the predictions, and of the observations: S is the unit matrix."""
GATE = 0.99
D2 = np.array([[3.25, 1.53, 4.16, 162.0], [21.25, 3.33, 1.16, 117.0]])
"""Squared distances by an independent calculation; the survey gives no numbers."""
BRANCHES, HYPOTHESES = 7, 72


def reproduce(runs: int | None, seed: int) -> Result:
    """Deterministic: runs and seed have no effect."""
    scan = Scan(0.0, OBSERVED, HALF)
    every = Problem.gated(Gate(1.0), PREDICTED, np.tile(HALF, (2, 1, 1)), scan)
    gated = Problem.gated(Gate(GATE), PREDICTED, np.tile(HALF, (2, 1, 1)), scan)
    d2 = every.pairs.d2.reshape(2, 4)
    inside = np.zeros((2, 4), bool)
    inside[gated.pairs.row, gated.pairs.measurement] = True
    taken = {rule: heaviest(method.decide(gated)) for rule, method in
             (("nn", NN()), ("greedy", GreedyGNN()), ("gnn", GNN()))}  # fmt: skip
    branches, hypotheses = counted(scan)
    drawing, (plan, table) = style.figure(2, panel=(5.6, 4.2))
    _plan(plan, inside, taken["gnn"].tolist())
    _table(table, d2, inside, taken["gnn"].tolist())
    rows: list[Row] = [
        {
            "track": f"P{t + 1}",
            "observation": f"O{j + 1}",
            "d2": float(d2[t, j]),
            "reference_d2": float(D2[t, j]),
            "gate": float(gated.pairs.limit[t]),
            "inside": int(inside[t, j]),
            **{rule: int(choice[t] == j) for rule, choice in taken.items()},
            "paper": "more than one observation in a gate, one observation in two gates",
        }
        for t in range(2)
        for j in range(4)
    ]
    verdict = (
        f"P1 takes O{taken['gnn'][0] + 1} and P2 takes O{taken['gnn'][1] + 1} by every rule that takes one, O4 starts "
        f"a track; branching makes {branches} branches and exclusive hypotheses number {hypotheses}, as an independent "
        f"enumeration has it ({BRANCHES} and {HYPOTHESES}); the largest difference of a distance from it is "
        f"{np.abs(d2 - D2).max():.1g}."
    )
    return Result(drawing, rows, verdict)


def counted(scan: Scan) -> tuple[int, int]:
    """Number of branches of the two tracks, and of hypotheses about all four observations without pruning."""
    x = np.zeros((2, 4))
    x[:, ::2] = PREDICTED
    made = []
    for rule in (Split(), MHT(hypotheses=1000, threshold=0.0, mass=1.0)):
        tracker = Tracker(ConstantVelocity(), rule, gate=GATE)
        tracker.add(0.0, x, np.tile(0.5 * np.eye(4), (2, 1, 1)))
        tracker.step(scan)
        made.append(tracker)
    branching, multiple = made
    assert isinstance(multiple.timing, Deferred)
    assert isinstance(multiple.timing.forest, HypothesisForest)
    in_clusters = np.diff(multiple.timing.forest.hypotheses.first)
    return int((branching.register.id <= 2).sum()), int(in_clusters.prod())


def _plan(ax: Axes, inside: np.ndarray, taken: list[int]) -> None:
    for t, colour in enumerate((style.BLUE, style.RED)):
        style.region(ax, PREDICTED[t], np.eye(2), GATE, color=colour)
        ax.plot(*PREDICTED[t], "+", color=colour, ms=10, mew=1.6)
        ax.text(PREDICTED[t, 0], PREDICTED[t, 1] - 0.7, f"P{t + 1}", color=colour, fontsize=10, ha="center")
        style.arrow(ax, PREDICTED[t], OBSERVED[taken[t]], colour)
    for j, (x, y) in enumerate(OBSERVED[:3]):
        ax.plot(x, y, "o", color=style.INK, ms=5)
        ax.text(x - 0.1, y + 0.25, f"O{j + 1}", fontsize=10, color=style.INK)
    style.arrow(ax, np.array([6.2, 3.0]), np.array([6.9, 3.7]), style.INK)
    ax.text(6.1, 2.6, "O4 at (9, 9)", fontsize=9, color=style.INK, ha="center")
    ax.set_aspect("equal")
    ax.set(xlabel="x", ylabel="y", xlim=(-3.6, 7.2), ylim=(-3.6, 4))
    style.title(ax, f"gates of {GATE:.0%}; arrows: the best exclusive assignment")


def _table(ax: Axes, d2: np.ndarray, inside: np.ndarray, taken: list[int]) -> None:
    ax.set_axis_off()
    ax.set(xlim=(-0.9, 4), ylim=(-0.3, 3))
    for j in range(4):
        ax.text(j + 0.5, 2.3, f"O{j + 1}", ha="center", fontsize=11, color=style.INK)
    for t, colour in enumerate((style.BLUE, style.RED)):
        ax.text(-0.3, 1.5 - t, f"P{t + 1}", ha="center", va="center", fontsize=11, color=colour)
        for j in range(4):
            chosen = taken[t] == j
            ink = "white" if chosen else style.INK if inside[t, j] else style.GREY
            face = colour if chosen else style.FAINT if inside[t, j] else "white"
            ax.text(j + 0.5, 1.5 - t, f"{d2[t, j]:.4g}", ha="center", va="center", fontsize=11, color=ink,
                    bbox={"boxstyle": "round,pad=0.5", "fc": face, "ec": "none"})  # fmt: skip
    ax.text(-0.6, 0.0, "grey: inside the gate; colour: assigned", fontsize=9, color=style.GREY)
    style.title(ax, "squared statistical distance d²")
