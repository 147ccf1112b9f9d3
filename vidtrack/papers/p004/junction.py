"""Figures 7 to 9: the tracks of the stop line's ghost and of the white car at the simulated T-junction.

The grey car covers the bright stop line until the running average of the `paper` detector no longer contains the line.
When the car leaves, the line is detected as a new object: the ghost. The white car follows.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from vidtrack.arrays.types import Floats, Ints
from vidtrack.associate.gate import Distance
from vidtrack.config.settings import TrackerSettings
from vidtrack.config.video import DetectorSettings, PaperSettings
from vidtrack.papers import style
from vidtrack.papers.p004.clips import Watched, believed, by_default, draw, follow, ids_on_targets, watch
from vidtrack.papers.result import Row
from vidtrack.simulate import simulate
from vidtrack.simulate.junction import HALF, ROAD, STOP_LINE
from vidtrack.tracks import Tracks

if TYPE_CHECKING:
    from matplotlib.figure import Figure

GREY, WHITE = 0, 1
"""Rows of the two cars among the targets."""
LINE = np.array(ROAD(STOP_LINE, -HALF / 2))
AT_LINE = 10.0
"""px from the line's middle."""
STAYS_S = 0.5
"""s; a track that stays longer at the uncovered line is not a passing car."""

TRAIL_S = 1.2
"""s of each path in the pictures."""
SEEDS = 10

DETECTORS = {
    "paper": DetectorSettings(kind="paper"),
    "paper, one-sided": DetectorSettings(kind="paper", paper=PaperSettings(two_sided=False)),
}
Case = tuple[str, Distance]
NEAR: Case = ("paper", "euclidean")
REGION: Case = ("paper", "mahalanobis")
DEFAULT: Case = ("default", "mahalanobis")
CASES: tuple[Case, ...] = (
    NEAR, REGION, ("paper, one-sided", "euclidean"), ("paper, one-sided", "mahalanobis"), DEFAULT
)  # fmt: skip
"""Detector and distance; only the default recognises merged blobs, which the paper does not treat."""


@dataclass(frozen=True, slots=True)
class JunctionOutcome:
    """The outcome for one case.

    ghosts  ids of the tracks that stayed at the uncovered line
    fate    of them: "none", "absorbs the white car", "alive when the white car comes", "deleted"
    white   track id of the white car before it reaches the line, and at the end; -1: none
    """

    ghosts: tuple[int, ...]
    fate: str
    white: tuple[int, int]

    @property
    def white_kept(self) -> bool:
        """Whether the white car kept one identity."""
        return self.white[0] == self.white[1] >= 0


@lru_cache(maxsize=2)
def filmed(seed: int) -> dict[Case, tuple[Watched, list[Tracks]]]:
    """The junction of a seed, tracked in every case."""
    clip = simulate("junction", seed=seed)
    default = by_default(clip)
    seen = {name: watch(clip, detector) for name, detector in DETECTORS.items()}
    result = {}
    for detector, distance in CASES[:-1]:
        settings = TrackerSettings(distance=distance, merged_blobs=False)
        result[detector, distance] = seen[detector], follow(seen[detector], settings)
    result[DEFAULT] = seen["paper"], default
    return result


@lru_cache(maxsize=2)
def outcomes(runs: int, seed: int) -> dict[Case, list[JunctionOutcome]]:
    """The outcomes of each case in videos with seeds from `seed` on."""
    seeds = range(seed, seed + runs)
    # Backwards: the first, which is drawn, is then still in the cache.
    found = {one: {case: junction_outcome(*film) for case, film in filmed(one).items()} for one in reversed(seeds)}
    return {case: [found[one][case] for one in seeds] for case in CASES}


def uncovered(watched: Watched) -> tuple[int, int]:
    """The first frame with the line free after the grey car, and the first with the white car on it."""
    low = watched.box[:, [GREY, WHITE], :2]
    high = low + watched.box[:, [GREY, WHITE], 2:]
    covers = np.all((low <= LINE) & (high >= LINE), axis=2)
    return int(np.flatnonzero(covers[:, 0])[-1]) + 1, int(np.flatnonzero(covers[:, 1])[0])


def junction_outcome(watched: Watched, steps: list[Tracks]) -> JunctionOutcome:
    """The outcome, from the tracks."""
    free, arrives = uncovered(watched)
    ids = ids_on_targets(watched, steps)
    ghosts = _staying(steps[free:arrives], round(STAYS_S * watched.clip.fps))
    white_end = int(np.flatnonzero(watched.whole[:, WHITE])[-1])
    white = int(ids[arrives - 3, WHITE]), int(ids[white_end, WHITE])
    if not ghosts:
        fate = "none"
    elif set(ghosts) & set(ids[arrives:, WHITE].tolist()):
        fate = "absorbs the white car"
    elif set(ghosts) & set(believed(steps[arrives])[0].tolist()):
        fate = "alive when the white car comes"
    else:
        fate = "deleted"
    return JunctionOutcome(ghosts, fate, white)


def _staying(steps: list[Tracks], least: int) -> tuple[int, ...]:
    """Ids of the tracks that are at the line in at least `least` frames."""
    there = [ids[_at_line(xy)] for ids, xy in map(believed, steps)]
    ids, frames = np.unique(np.concatenate(there), return_counts=True)
    return tuple(ids[frames >= least].tolist())


def _at_line(xy: Floats) -> Ints:
    return np.flatnonzero(np.linalg.norm(xy - LINE, axis=1) < AT_LINE)


def table(found: dict[Case, list[JunctionOutcome]]) -> list[Row]:
    """The first video's ids and the shares over all of them."""
    return [
        {
            "detector": detector,
            "distance": distance,
            "ghost": " ".join(map(str, one[0].ghosts)),
            "fate": one[0].fate,
            "white_car_before": one[0].white[0],
            "white_car_after": one[0].white[1],
            "videos": len(one),
            "ghost_in": _share(outcome.fate != "none" for outcome in one),
            "ghost_absorbs_white_car_in": _share(outcome.fate == "absorbs the white car" for outcome in one),
            "white_car_keeps_identity_in": _share(outcome.white_kept for outcome in one),
            "paper": {
                NEAR: "ghost 15 lives on and absorbs the white car 19", REGION: "ghost 15 deleted, white car stays 19"
            }.get((detector, distance), ""),
        }
        for (detector, distance), one in found.items()
    ]  # fmt: skip


def panels(seed: int, frame: Callable[[int, int], int]) -> Figure:
    """Pictures of the three main cases at a frame, a function of the two frames of `uncovered`."""
    drawing, axes = style.figure(3, panel=(4.6, 2.8))
    films = filmed(seed)
    k = frame(*uncovered(films[NEAR][0]))
    words = ("minimum distance", "confidence region", "default settings")
    for ax, case, letter, text in zip(axes, (NEAR, REGION, DEFAULT), "abc", words, strict=True):
        watched, steps = films[case]
        draw(ax, watched, steps, k, first=max(0, k - round(TRAIL_S * watched.clip.fps)))
        ax.plot(*LINE, "o", ms=30, mfc="none", mec=style.INK, mew=1.2)
        ax.set(xlim=(LINE[0] - 90, LINE[0] + 90), ylim=(LINE[1] + 45, LINE[1] - 50))
        style.title(ax, f"({letter}) {text}, {k / watched.clip.fps:.1f} s")
    return drawing


def _share(those: Iterable[bool]) -> float:
    return float(np.mean(list(those)))
