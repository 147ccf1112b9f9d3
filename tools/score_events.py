"""Score counted crossings against crossings found by eye, event by event.

    python tools/score_events.py COUNTS.csv TRUTH.csv

COUNTS is a run's counts.csv; TRUTH has frame, line, direction, certain (0 or 1), tolerance_frames. A count hits a
crossing of the same line and direction within its tolerance; one to one, as many as possible, certain crossings
before uncertain ones, then the nearest in time. Uncertain crossings may be hit or missed at no cost.
"""

from __future__ import annotations

import argparse
import csv
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from scipy.optimize import linear_sum_assignment

NEVER, UNCERTAIN = 1e6, 1e3  # costs beside frames: of pairs that do not fit, and of a crossing that does not count


@dataclass(frozen=True)
class Event:
    """A crossing; `certain` and `tolerance` [frames] are of the truth, `track` is of a count."""

    line: str
    frame: float
    direction: str
    certain: bool = True
    tolerance: float = 0.0
    track: int = -1


@dataclass(frozen=True)
class Judged:
    """Crossings that were counted, those that were not, and counts of nothing."""

    hit: int = 0
    missed: list[Event] = field(default_factory=list)
    false: list[Event] = field(default_factory=list)

    def __add__(self, other: Judged) -> Judged:
        return Judged(self.hit + other.hit, self.missed + other.missed, self.false + other.false)

    def __str__(self) -> str:
        return f"{self.hit}/{len(self.missed)}/{len(self.false)}"

    @property
    def recall(self) -> float:
        """Share of the certain crossings that were counted."""
        return self.hit / max(self.hit + len(self.missed), 1)

    @property
    def precision(self) -> float:
        """Share of the counts that hit a certain crossing, those of uncertain ones left out."""
        return self.hit / max(self.hit + len(self.false), 1)


def read_truth(path: Path) -> list[Event]:
    """The crossings found by eye."""
    with path.open() as file:
        return [
            Event(
                row["line"], int(row["frame"]), row["direction"], row["certain"] == "1", float(row["tolerance_frames"])
            )
            for row in csv.DictReader(file)
        ]


def read_counts(path: Path) -> list[Event]:
    """The crossings of a counts.csv."""
    with path.open() as file:
        return [
            Event(row["line"], int(row["frame"]), row["direction"], track=int(row["track_id"]))
            for row in csv.DictReader(file)
        ]


def judge(counts: Iterable[Event], truth: Iterable[Event]) -> Judged:
    """Counts against the truth; those of a line that nobody crosses are false."""
    counts, truth = list(counts), list(truth)
    cost = np.array([[_cost(seen, true) for seen in counts] for true in truth]).reshape(len(truth), len(counts))
    pairs = [(i, j) for i, j in zip(*linear_sum_assignment(cost), strict=True) if cost[i, j] < NEVER]
    found, used = {i for i, _ in pairs}, {j for _, j in pairs}
    return Judged(
        hit=sum(truth[i].certain for i in found),
        missed=[event for i, event in enumerate(truth) if event.certain and i not in found],
        false=[event for j, event in enumerate(counts) if j not in used],
    )


def _cost(seen: Event, true: Event) -> float:
    away = abs(seen.frame - true.frame)
    fits = (seen.line, seen.direction) == (true.line, true.direction) and away <= true.tolerance
    return away + UNCERTAIN * (not true.certain) if fits else NEVER


def main() -> None:
    """Print the scores of each line and of all."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("counts", type=Path, help="counts.csv of a run")
    parser.add_argument("truth", type=Path, help="crossings found by eye")
    options = parser.parse_args()
    counts, truth = read_counts(options.counts), read_truth(options.truth)
    if strange := {event.line for event in counts} - {event.line for event in truth}:
        parser.error(f"no truth for lines {', '.join(sorted(strange))}")
    total = Judged()
    for line in sorted({event.line for event in truth}):
        scored = judge([e for e in counts if e.line == line], [e for e in truth if e.line == line])
        total += scored
        print(f"{line}: hit {scored.hit} missed {len(scored.missed)} false {len(scored.false)}")
    print(f"all: hit/missed/false {total} recall {total.recall:.3f} precision {total.precision:.3f}")


if __name__ == "__main__":
    main()
