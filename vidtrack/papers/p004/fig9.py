"""Figure 9: the white car, with its own track or absorbed by the stop line's ghost."""

from __future__ import annotations

from vidtrack.papers.p004.junction import DEFAULT, NEAR, REGION, SEEDS, outcomes, panels, table
from vidtrack.papers.result import Result


def reproduce(runs: int | None, seed: int) -> Result:
    """Track `runs` videos with seeds from `seed` on; the figure shows the first."""
    runs = SEEDS if runs is None else runs
    found = outcomes(runs, seed)
    kept = {case: sum(outcome.white_kept for outcome in found[case]) for case in found}
    (near_before, near_after), (region_before, region_after) = found[NEAR][0].white, found[REGION][0].white
    verdict = (
        f"seed {seed}: the white car is {near_before}, then {near_after} by minimum distance, {region_before}, then "
        f"{region_after} by confidence region (the paper: 19, then 15; 19 throughout); of {runs} videos it keeps its "
        f"identity in {kept[NEAR]} and {kept[REGION]}, one-sided in {kept['paper, one-sided', 'euclidean']} and "
        f"{kept['paper, one-sided', 'mahalanobis']}, by default in {kept[DEFAULT]}."
    )
    return Result(panels(seed, lambda free, arrives: arrives + 30), table(found), verdict)
