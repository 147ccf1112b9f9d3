"""Figure 5: branching gives each of two close targets its track."""

from __future__ import annotations

from vidtrack.papers.p001 import close
from vidtrack.papers.result import Result


def reproduce(runs: int | None, seed: int) -> Result:
    """Branching on the two close targets of figure 4."""
    paper = "as in the paper's sketch, branching most often tells the two apart where nearest neighbour does not"
    return close.reproduce("split", paper, runs, seed)
