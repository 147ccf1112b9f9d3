"""Rates of lost identities by minimum distance and by confidence region: thousands of crossings as one bank.

The paper shows one crossing. Here two targets cross at right angles in each of many runs, merged in one blob for eight
frames or always separate, along the axes or rotated by 45 degrees. A second experiment has nine targets.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import zip_longest
from typing import TYPE_CHECKING

import numpy as np

from vidtrack.arrays.types import Floats
from vidtrack.associate.gate import Distance
from vidtrack.papers import style
from vidtrack.papers.p004 import reference
from vidtrack.papers.p004.scenarios import DISTANCES, crossing, nine, shares, wrong_identities
from vidtrack.papers.result import Result, Row

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

RUNS = 10_000
RUNS_PER_NINE = 20
"""Crossings for each run of nine targets, which takes longer."""
BATCH = 1000
"""Crossings after which there is a result, so that a killed process leaves one."""

Pair = tuple[str, Distance]
PAIRS: tuple[Pair, ...] = tuple((method, distance) for distance in DISTANCES for method in ("nn", "gnn"))
"""Pairs in the reference."""
OTHERS: tuple[Pair, ...] = tuple((name, "mahalanobis") for name in ("generalized-nn", "pda", "jpda", "split", "mht"))
WORDS = {"euclidean": "minimum distance", "decoupled": "region, eq. (8)", "mahalanobis": "region, full S"}


@dataclass(frozen=True, slots=True)
class Outcome:
    """Shares (4,) of the runs of one scenario, by pair, and how many runs they stand on."""

    runs: int
    shares: dict[Pair, Floats]


Table = dict[str, Outcome]


def reproduce(runs: int | None, seed: int) -> Iterator[Result]:
    """Simulate all scenarios and methods with `runs` crossings each; a result after each batch of them."""
    for table, wrong in measure(RUNS if runs is None else runs, seed):
        yield Result(_figure(table, wrong), _rows(table, wrong), _verdict(table))


def measure(
    runs: int, seed: int, pairs: tuple[Pair, ...] = PAIRS + OTHERS
) -> Iterator[tuple[Table, dict[Pair, Floats]]]:
    """Outcomes of each scenario, and wrong identities (runs,) of nine targets for each pair, so far."""
    rng = np.random.default_rng(seed)
    table: Table = {}
    for scenario in reference.CROSSING:
        turn = np.pi / 4 if "45" in scenario else 0.0
        count, before = dict.fromkeys(pairs, np.zeros(4)), 0
        for done, targets in crossing(runs, turn, "never" not in scenario, rng).batches(BATCH):
            count = {pair: count[pair] + shares(targets, *pair) * (done - before) for pair in pairs}
            table[scenario] = Outcome(done, {pair: ended / done for pair, ended in count.items()})
            before = done
            yield table, {}
    wrong = dict.fromkeys(pairs, np.zeros(0))
    for _, targets in nine(-(-runs // RUNS_PER_NINE), rng).batches(BATCH // RUNS_PER_NINE):
        wrong = {pair: np.append(wrong[pair], wrong_identities(targets, *pair)) for pair in pairs}
        yield table, wrong


def difference(ours: Floats, runs: int, theirs: Floats) -> Floats:
    """Differences of shares from the reference's in units of their combined standard error, from the pooled share."""
    pooled = (ours * runs + theirs * reference.RUNS + 0.5) / (runs + reference.RUNS + 1)
    return (ours - theirs) / np.sqrt(pooled * (1 - pooled) * (1 / runs + 1 / reference.RUNS))


def _rows(table: Table, wrong: dict[Pair, Floats]) -> list[Row]:
    rows: list[Row] = []
    for scenario, outcome in table.items():
        runs = outcome.runs
        for pair, ours in outcome.shares.items():
            columns = [ours, _se(ours, runs)]
            if pair in reference.CROSSING[scenario]:
                theirs = np.array(reference.CROSSING[scenario][pair])
                columns += [theirs, _se(theirs, reference.RUNS), difference(ours, runs, theirs)]
            for kind, numbers in zip(reference.CLASSES, np.transpose(columns).tolist(), strict=True):
                rows.append(_row(scenario, pair, kind, runs, *numbers))
    for pair, count in wrong.items():  # the reference's starting points are unknown: no difference is formed
        ours_and_se = float(count.mean()), float(count.std() / np.sqrt(len(count)))
        rows.append(
            _row("nine targets, other starting points", pair, "wrong identities of 9", len(count), *ours_and_se,
                 *reference.NINE.get(pair, ()))
        )  # fmt: skip
    return rows


def _row(scenario: str, pair: Pair, outcome: str, runs: int, *numbers: float | str) -> Row:
    names = ("ours", "ours_se", "reference", "reference_se", "difference_in_se")
    head: Row = {"scenario": scenario, "method": pair[0], "distance": pair[1], "outcome": outcome, "runs": runs}
    return head | dict(zip_longest(names, numbers, fillvalue=""))


def _se(share: Floats, runs: int) -> Floats:
    return np.sqrt(share * (1 - share) / runs)


def _verdict(table: Table) -> str:
    first = next(iter(table.values()))
    fail = {pair: f"{1 - shares[0]:.1%}" for pair, shares in first.shares.items()}
    off = {
        (scenario, pair, kind): d
        for scenario, outcome in table.items()
        for pair, ours in outcome.shares.items()
        if pair in PAIRS
        for kind, d in zip(
            reference.CLASSES, difference(ours, outcome.runs, np.array(reference.CROSSING[scenario][pair])), strict=True
        )
    }
    far = {key: d for key, d in off.items() if abs(d) > 4}
    text = (
        f"of {first.runs} crossings merged for 8 frames, minimum distance fails in {fail['gnn', 'euclidean']} and the "
        f"confidence region in {fail['gnn', 'mahalanobis']} with gnn, in {fail['nn', 'euclidean']} and "
        f"{fail['nn', 'mahalanobis']} with nn, in {fail['jpda', 'mahalanobis']} with jpda and in "
        f"{fail['mht', 'mahalanobis']} with mht; {len(off) - len(far)} of {len(off)} shares are within 4 standard "
        f"errors of the reference"
    )
    low = ", ".join(sorted({kind for (_, _, kind), d in far.items() if d < 0}))
    high = ", ".join(sorted({kind for (_, _, kind), d in far.items() if d > 0}))
    return text + (f", some lower ({low})" if low else "") + (f", some higher ({high})" if high else "") + "."


def _figure(table: Table, wrong: dict[Pair, Floats]) -> Figure:
    drawing, panels = style.figure(3, 2, panel=(4.8, 3.8))
    for ax, (scenario, outcome) in zip(panels, table.items(), strict=False):
        _failures(ax, outcome.shares, reference.CROSSING[scenario])
        style.title(ax, scenario)
    if wrong:
        _wrong(panels[4], wrong)
    for ax in panels:
        if not ax.has_data():  # not run yet, or the legend's
            ax.set_axis_off()
    both = [ax.get_legend_handles_labels() for ax in (panels[0], panels[4])]
    handles, labels = both[0][0] + both[1][0], both[0][1] + both[1][1]
    panels[5].legend(handles, labels, frameon=False, fontsize=9, loc="center", title="outcome of the runs that fail")
    return drawing


def _failures(ax: Axes, ours: dict[Pair, Floats], theirs: reference.Shares) -> None:
    """Draw stacked bars of swap, merge and lost for each method; the reference's total as a tick."""
    y = np.arange(len(ours), dtype=float)[::-1]
    left = np.zeros(len(ours))
    for i, colour in ((1, style.RED), (2, style.ORANGE), (3, style.GREY)):
        width = np.array([shares[i] for shares in ours.values()])
        ax.barh(y, 100 * width, left=100 * left, color=colour, height=0.62, label=reference.CLASSES[i])
        left += width
    ax.plot(
        [100 * (1 - theirs[pair][0]) for pair in PAIRS],
        y[: len(PAIRS)],
        "|",
        color=style.INK,
        ms=15,
        mew=1.6,
        label="reference, total",
    )
    _name_rows(ax, y)
    ax.set_xlabel("share of the runs (%)")


def _wrong(ax: Axes, wrong: dict[Pair, Floats]) -> None:
    y = np.arange(len(wrong), dtype=float)[::-1]
    mean = [float(count.mean()) for count in wrong.values()]
    ax.barh(y, mean, color=style.BLUE, height=0.62)
    ax.plot(
        [reference.NINE[pair][0] for pair in PAIRS],
        y[: len(PAIRS)],
        "o",
        markeredgecolor=style.GREY,
        markerfacecolor="none",
        ls="none",
        label="reference of nine targets, from other\nstarting points: not to be compared bar by bar",
    )
    _name_rows(ax, y)
    ax.set_xlabel("mean wrong identities of 9")
    style.title(ax, "nine targets")


def _name_rows(ax: Axes, y: Floats) -> None:
    ax.set_yticks(y, [f"{WORDS[distance]}, {method}" for method, distance in PAIRS + OTHERS])
    ax.tick_params(axis="y", length=0, labelcolor=style.INK)
