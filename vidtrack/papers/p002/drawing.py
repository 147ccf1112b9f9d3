"""Drawing of both figures: one panel per case."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from vidtrack.papers import style
from vidtrack.papers.p002.experiment import SCANS, Study
from vidtrack.radar.performance.monte_carlo import root_mean_square

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def draw(studies: Sequence[Study]) -> Figure:
    """Four panels: both predictions, the error of all runs and of those never above LOST, with 95 % bands."""
    drawing, panels = style.figure(2, 2, panel=(4.8, 3.4))
    for ax, study in zip(panels, studies, strict=True):
        _panel(ax, study)
    handles, labels = panels[0].get_legend_handles_labels()
    drawing.legend(handles, labels, loc="outside lower center", ncols=2, frameon=False, fontsize=9)
    return drawing


def _panel(ax: Axes, study: Study) -> None:
    k = np.arange(1, SCANS + 1)
    kept, kept_se = root_mean_square(study.kept)
    every, every_se = root_mean_square(study.psn.error)
    for mean, se, colour, alpha, label in (
        (every, every_se, style.GREY, 0.12, "simulated, all runs, 95 %"),
        (kept, kept_se, style.BLUE, 0.3, "simulated, runs never above 20, 95 %"),
    ):
        ax.fill_between(k, mean - 1.96 * se, mean + 1.96 * se, color=colour, alpha=alpha, lw=0)
        ax.plot(k, mean, ".", ms=3, color=colour, label=label)
    ax.plot(k, study.corrected, color=style.GREEN, lw=1.5, label="predicted, corrected")
    ax.plot(k, study.printed, "--", color=style.RED, lw=1.5, label="predicted, eq. (33) as printed")
    diverges = study.corrected[-1] > 2 * study.printed[-1]
    if diverges:
        ax.set_yscale("log")
        ax.set_yticks([2, 5, 10, 20, 50], ["2", "5", "10", "20", "50"])
        ax.minorticks_off()
    else:
        ax.set_ylim(1.0, 1.25 * max(study.corrected.max(), kept.max()))
    ax.set_xlabel("scan k")
    ax.set_ylabel("position error, units of sqrt(r)" + (" (log)" if diverges else ""))
    style.title(ax, f"{study.case.name}: {study.lost:.2%} lost")
