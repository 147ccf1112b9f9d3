"""Figure 4: without branching a track wanders between two close targets."""

from __future__ import annotations

from vidtrack.papers.p001 import close
from vidtrack.papers.result import Result


def reproduce(runs: int | None, seed: int) -> Result:
    """The nearest neighbour on two close targets, and the share of right runs of all methods."""
    paper = "as in the paper's sketch, the nearest measurement is often the other target's, and tracks wander"
    return close.reproduce("nn", paper, runs, seed)
