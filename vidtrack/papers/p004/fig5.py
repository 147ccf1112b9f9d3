"""Figure 5: two crossing objects in a video, by minimum distance and by confidence region."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from vidtrack.papers import style
from vidtrack.papers.p004 import reference
from vidtrack.papers.p004.clips import APART, ON_TARGET, Watched, believed, draw, ids_on_targets, watch
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

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SEEDS = 200


def reproduce(runs: int | None, seed: int) -> Result:
    """Track `runs` videos with seeds from `seed` on; the figure shows the one most like the paper."""
    seeds = range(seed, seed + (SEEDS if runs is None else runs))
    outcomes = [outcomes_of(watch(simulate("crossing", seed=one))) for one in seeds]
    shown = min(range(len(seeds)), key=lambda i: _unlike_paper(outcomes[i]))
    share = {way: _shares([one[way] for one in outcomes]) for way in WAYS}
    rows = [_row(way, share[way], len(seeds)) for way in WAYS]

    drawing, panels = style.figure(3, panel=(4.4, 3.7))
    watched = watch(simulate("crossing", seed=seeds[shown]))
    followed = follow_all(watched)
    for ax, way, letter in zip(panels, (NEAR, REGION), "ab", strict=False):
        draw(ax, watched, followed[way], moments(watched)[1])
        style.title(ax, f"({letter}) {WORDS[way.distance]}, seed {seeds[shown]}: {outcomes[shown][way]}")
    _bars(panels[2], share)
    style.title(panels[2], f"{len(seeds)} videos")
    return Result(drawing, rows, _verdict(share, seeds, shown, outcomes[shown]))


def outcomes_of(watched: Watched) -> dict[Way, str]:
    """The outcome of the two identities for each method."""
    before, end = moments(watched)
    return {way: outcome(watched, steps, before, end) for way, steps in follow_all(watched).items()}


def moments(watched: Watched) -> tuple[int, int]:
    """The last frame before the targets touch, and the last with both wholly in the picture."""
    low, high = watched.box[..., :2], watched.box[..., :2] + watched.box[..., 2:]
    gap = np.maximum(low[:, 0] - high[:, 1], low[:, 1] - high[:, 0]).max(axis=1)
    both = watched.whole.all(axis=1)
    return int(np.flatnonzero(both & (gap < APART))[0]) - 1, int(np.flatnonzero(both)[-1])


def outcome(watched: Watched, steps: list[Tracks], before: int, end: int) -> str:
    """correct, swap, merge (both tracks on one target), or lost (a track ended, or is far from both targets)."""
    mine = ids_on_targets(watched, steps)[before]
    ids, xy = believed(steps[end])
    if not np.isin(mine, ids).all():
        return "lost"
    at = np.array([xy[ids == track][0] for track in mine])
    away = np.linalg.norm(at[:, None] - watched.centre[end][None], axis=-1)
    if (away.min(axis=1) > ON_TARGET).any():
        return "lost"
    return {(0, 1): "correct", (1, 0): "swap"}.get(tuple(away.argmin(axis=1).tolist()), "merge")


def _unlike_paper(told: dict[Way, str]) -> tuple[bool, ...]:
    """Sort key: videos with the confidence region correct and minimum distance swapped come first."""
    return told[REGION] != "correct", told[NEAR] == "correct", told[NEAR] != "swap"


def _shares(outcomes: list[str]) -> dict[str, float]:
    return {name: outcomes.count(name) / len(outcomes) for name in reference.CLASSES}


def _row(way: Way, share: dict[str, float], videos: int) -> Row:
    """A table row: our shares, and the failures of the Monte Carlo reference, which has points and no detector."""
    theirs = reference.CROSSING["axis-aligned, merged for 8 frames"][way.method, way.distance]
    return {
        **way.row(),
        "videos": videos,
        **share,
        "failures": 1 - share["correct"],
        "se": float(np.sqrt(share["correct"] * (1 - share["correct"]) / videos)),
        "reference_failures_of_points": 1 - theirs[0] if way.shared == "no measurement" else "",
        "paper": way.paper("swap", "correct"),
    }


def _bars(ax: Axes, share: dict[Way, dict[str, float]]) -> None:
    """Draw the failures of each method, by kind."""
    y = np.array([9.5, 8.5, 7.5, 6.5, 4.8, 3.8, 2.8, 1.8, 0.0])
    left = np.zeros(len(WAYS))
    for name, colour in zip(reference.CLASSES[1:], (style.RED, style.ORANGE, style.GREY), strict=True):
        width = np.array([100 * share[way][name] for way in WAYS])
        ax.barh(y, width, left=left, color=colour, height=0.7, label=name)
        left += width
    for at, text in ((10.3, "shared blob: one measurement"), (5.6, "no measurement"), (0.8, "recognised (default)")):
        ax.text(0, at, text, fontsize=8, color=style.GREY, va="center")
    ax.set_yticks(y, [str(way) for way in WAYS])
    ax.tick_params(axis="y", length=0, labelcolor=style.INK)
    ax.set(xlabel="videos in which an identity fails (%)", xlim=(0, 100), ylim=(-0.6, 10.8))
    style.legend(ax, loc="lower right")


def _verdict(share: dict[Way, dict[str, float]], seeds: range, shown: int, told: dict[Way, str]) -> str:
    fail = {way: f"{1 - one['correct']:.3g}" for way, one in share.items()}
    return (
        f"seed {seeds[shown]}, the one most like the paper: {told[NEAR]} by minimum distance, {told[REGION]} by "
        f"confidence region (the paper: swap, correct); the share of {len(seeds)} videos in which an identity fails "
        f"(gnn) is {fail[NEAR_UNSHARED]} and {fail[REGION_UNSHARED]} if the shared blob measures neither vehicle, but "
        f"{fail[NEAR]} and {fail[REGION]} if it is taken for one of them, and {fail[DEFAULT]} by default, where merged "
        f"blobs are recognised."
    )
