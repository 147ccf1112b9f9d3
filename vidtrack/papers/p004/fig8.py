"""Figure 8: the stop line's ghost when the grey car has passed and the white car comes."""

from __future__ import annotations

from vidtrack.papers.p004.junction import NEAR, REGION, SEEDS, Case, outcomes, panels, table
from vidtrack.papers.result import Result


def reproduce(runs: int | None, seed: int) -> Result:
    """Track `runs` videos with seeds from `seed` on; the figure shows the first."""
    runs = SEEDS if runs is None else runs
    found = outcomes(runs, seed)

    def lives(case: Case) -> int:
        return sum(
            outcome.fate in ("absorbs the white car", "alive when the white car comes") for outcome in found[case]
        )

    one_sided = [lives(("paper, one-sided", distance)) for distance in ("euclidean", "mahalanobis")]
    verdict = (
        f"seed {seed}: ghost by minimum distance: {found[NEAR][0].fate}; by confidence region: {found[REGION][0].fate} "
        f"(the paper: lives; deleted); of {runs} videos it lives until the white car comes in {lives(NEAR)} and "
        f"{lives(REGION)}, one-sided in {one_sided[0]} and {one_sided[1]}."
    )
    return Result(panels(seed, lambda free, arrives: arrives - 2), table(found), verdict)
