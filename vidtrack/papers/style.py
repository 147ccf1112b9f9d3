"""The common style of all figures."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from vidtrack.arrays.types import Floats
from vidtrack.associate.gate import quantile

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Okabe and Ito: distinct for every kind of colour vision, and in print.
BLUE, ORANGE, GREEN, RED, PURPLE, SKY = "#0072B2", "#E69F00", "#009E73", "#D55E00", "#CC79A7", "#56B4E9"
INK, GREY, FAINT = "#222222", "#777777", "#D5D5D5"
CYCLE = (BLUE, RED, GREEN, PURPLE, ORANGE, SKY)


def figure(columns: int = 1, rows: int = 1, *, panel: tuple[float, float] = (4.6, 3.8)) -> tuple[Figure, list[Axes]]:
    """A figure and its panels in reading order; panel: (width, height) of each in inches."""
    from matplotlib.figure import Figure  # not pyplot: it keeps figures alive and looks for a screen

    drawing = Figure((columns * panel[0], rows * panel[1]), dpi=150, layout="constrained", facecolor="white")
    panels = list(drawing.subplots(rows, columns, squeeze=False).flat)
    for ax in panels:
        ax.spines[["top", "right"]].set_visible(False)
        for spine in ax.spines.values():
            spine.set_color(GREY)
        ax.tick_params(colors=GREY, labelsize=8)
        ax.xaxis.label.set(color=INK, fontsize=9)
        ax.yaxis.label.set(color=INK, fontsize=9)
    return drawing, panels


def title(ax: Axes, text: str, colour: str = INK) -> None:
    """Left-aligned heading of a panel."""
    ax.set_title(text, loc="left", fontsize=10, color=colour)


def legend(ax: Axes, **place: Any) -> None:
    """A legend without a frame."""
    ax.legend(frameon=False, fontsize=8, labelcolor=INK, **place)


def region(ax: Axes, centre: Floats, cov: Floats, probability: float, **look: Any) -> None:
    """The confidence region of a predicted position: the ellipse v' S^-1 v = chi-square quantile."""
    from matplotlib.patches import Ellipse

    variance, axis = np.linalg.eigh(cov)
    width, height = 2 * np.sqrt(quantile(probability, 2) * variance)
    angle = np.degrees(np.arctan2(axis[1, 0], axis[0, 0]))
    ax.add_patch(Ellipse((centre[0], centre[1]), width, height, angle=angle, **{"fill": False, "lw": 1.2, **look}))


def arrow(ax: Axes, start: Floats, end: Floats, colour: str, style: str = "-|>", **look: Any) -> None:
    """An arrow from start (2,) to end (2,)."""
    properties = {"arrowstyle": style, "color": colour, "lw": 1.4, "shrinkA": 0, "shrinkB": 0, **look}
    ax.annotate("", xy=tuple(end), xytext=tuple(start), arrowprops=properties)
