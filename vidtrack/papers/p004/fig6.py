"""Figure 6: nine objects in a video, by minimum distance and by confidence region."""

from __future__ import annotations

import numpy as np

from vidtrack.arrays.types import Floats, Ints
from vidtrack.papers import style
from vidtrack.papers.p004 import reference
from vidtrack.papers.p004.clips import Watched, draw, ids_on_targets, watch
from vidtrack.papers.p004.ways import (
    DEFAULT,
    NEAR,
    NEAR_UNSHARED,
    REGION,
    REGION_UNSHARED,
    WAYS,
    WORDS,
    Way,
    follow_all,
)
from vidtrack.papers.result import Result, Row
from vidtrack.simulate import simulate
from vidtrack.tracks import Tracks

SEEDS = 30


def reproduce(runs: int | None, seed: int) -> Result:
    """Track `runs` videos with seeds from `seed` on; the figure shows the one with the largest gain by the region."""
    seeds = range(seed, seed + (SEEDS if runs is None else runs))
    lost = [lost_in(watch(simulate("nine", seed=one))) for one in seeds]
    count = {way: np.array([one[way].size for one in lost], float) for way in WAYS}
    shown = int(np.argmax(count[NEAR] - count[REGION]))

    drawing, panels = style.figure(2, panel=(5.2, 4.2))
    watched = watch(simulate("nine", seed=seeds[shown]))
    followed = follow_all(watched)
    for ax, way, letter in zip(panels, (NEAR, REGION), "ab", strict=True):
        draw(ax, watched, followed[way], len(watched.scans) * 2 // 3)
        style.title(
            ax, f"({letter}) {WORDS[way.distance]}, seed {seeds[shown]}: {lost[shown][way].size} of 9 identities lost"
        )
    mean = {way: f"{lost_of_9.mean():.2f}" for way, lost_of_9 in count.items()}
    verdict = (
        f"seed {seeds[shown]}, the one most like the paper: {lost[shown][NEAR].size} of 9 vehicles lose their identity "
        f"by minimum distance, {lost[shown][REGION].size} by confidence region (the paper: one absorbed, none); over "
        f"{len(seeds)} videos the mean (gnn) is {mean[NEAR_UNSHARED]} and {mean[REGION_UNSHARED]} if a shared blob "
        f"measures nobody, {mean[NEAR]} and {mean[REGION]} if it is taken for one vehicle, and {mean[DEFAULT]} by "
        f"default, where merged blobs are recognised."
    )
    return Result(drawing, [_row(way, count[way]) for way in WAYS], verdict)


def lost_in(watched: Watched) -> dict[Way, Ints]:
    """The targets that lose their identity, for each method."""
    return {way: lost_identities(watched, steps) for way, steps in follow_all(watched).items()}


def lost_identities(watched: Watched, steps: list[Tracks]) -> Ints:
    """Indices of targets whose first track is not on them in their last frame wholly in the picture."""
    ids = ids_on_targets(watched, steps)
    targets = np.arange(ids.shape[1])
    last = len(ids) - 1 - watched.whole[::-1].argmax(axis=0)
    first = (ids >= 0).argmax(axis=0)
    return np.flatnonzero((ids[first, targets] != ids[last, targets]) | (ids[last, targets] < 0))


def _row(way: Way, count: Floats) -> Row:
    """A table row: our mean, and that of the Monte Carlo reference, which has points, other paths and no detector."""
    return {
        **way.row(),
        "videos": len(count),
        "mean_lost_of_9": float(count.mean()),
        "se": float(count.std() / np.sqrt(len(count))),
        "videos_without_loss": int((count == 0).sum()),
        "reference_mean_of_points": reference.NINE[way.method, way.distance][0]
        if way.shared == "no measurement"
        else "",
        "paper": way.paper("one absorbed, its vehicle reborn as 6", "none"),
    }
