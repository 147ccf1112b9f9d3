"""Figure 7: the T-junction at about two seconds, the grey car on the stop line."""

from __future__ import annotations

from vidtrack.papers.p004.junction import DEFAULT, NEAR, REGION, SEEDS, outcomes, panels, table
from vidtrack.papers.result import Result


def reproduce(runs: int | None, seed: int) -> Result:
    """Track `runs` videos with seeds from `seed` on; the figure shows the first."""
    runs = SEEDS if runs is None else runs
    found = outcomes(runs, seed)
    ghosts = {case: sum(outcome.fate != "none" for outcome in found[case]) for case in found}
    verdict = (
        f"the stop line that the grey car uncovers becomes a target (the paper: target 15) in {ghosts[NEAR]} of {runs} "
        f"videos by minimum distance and in {ghosts[REGION]} by confidence region; one-sided in "
        f"{ghosts['paper, one-sided', 'euclidean']} and {ghosts['paper, one-sided', 'mahalanobis']}; with the default "
        f"detector in {ghosts[DEFAULT]}."
    )
    return Result(panels(seed, lambda free, arrives: free - 6), table(found), verdict)
