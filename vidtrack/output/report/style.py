"""One look for all pictures of a report: few colours that stay apart in grey, small enough for a telephone."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from io import BytesIO
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, MaxNLocator

from vidtrack.arrays.types import Floats
from vidtrack.traffic.clock import Clock

INK, BLUE, PALE, GREY, SIGNAL = "#1c2733", "#2f5d8a", "#c3d3e3", "#8a949e", "#b3471b"
WIDTH = 5.4
"""in; of every picture"""
_DPI = 200
_LOOK: dict[Any, Any] = {
    "font.family": "DejaVu Sans",
    "font.size": 8.5,
    "axes.titlesize": 8.5,
    "axes.titlelocation": "left",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.edgecolor": GREY,
    "axes.labelcolor": INK,
    "axes.linewidth": 0.7,
    "xtick.color": INK,
    "ytick.color": INK,
    "text.color": INK,
    "hatch.color": GREY,
    "hatch.linewidth": 0.5,
    "legend.frameon": False,
    "text.parse_math": False,  # a $ in a name is a $
    "axes.unicode_minus": False,
}
_STEPS = np.array(
    [0.1, 0.2, 0.5, 1, 2, 5, 10, 15, 30, 60, 120, 300, 600, 900, 1800, 3600, 7200, 10800, 14400, 21600, 43200, 86400]
)
_MINUTE_S = 60.0
_TICKS, _TICKS_WITH_SECONDS = 8, 6
"""Most steps along an axis; fewer of the longer labels"""


@contextmanager
def drawing(
    height: float, rows: int = 1, columns: int = 1, shared: bool = False
) -> Iterator[tuple[Figure, np.ndarray]]:
    """A picture with its axes (rows, columns), in the look of the report; close it by `png`."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    with mpl.rc_context(_LOOK):
        figure = Figure((WIDTH, height), layout="constrained")
        FigureCanvasAgg(figure)
        yield figure, figure.subplots(rows, columns, squeeze=False, sharex=shared, sharey=shared and columns == 1)


def png(figure: Figure) -> bytes:
    """The same bytes for the same picture."""
    with BytesIO() as file:
        figure.savefig(file, format="png", dpi=_DPI, metadata={"Software": None})
        return file.getvalue()


def time_axis(axes: Axes, clock: Clock, edges: Floats) -> None:
    """Times of day below, at full steps of the clock, and in the axis' name what they are."""
    zero = 0.0
    if clock.zero is not None:
        zero = clock.zero.hour * 3600 + clock.zero.minute * 60 + clock.zero.second + clock.zero.microsecond * 1e-6
    span = edges[-1] - edges[0]
    fits = span <= _STEPS * np.where(_STEPS < _MINUTE_S, _TICKS_WITH_SECONDS, _TICKS)
    step = float(_STEPS[fits][0] if fits.any() else _STEPS[-1])
    ticks = np.arange(np.ceil((edges[0] + zero) / step - 1e-6), np.floor((edges[-1] + zero) / step + 1e-6) + 1) * step
    axes.set_xticks(ticks - zero)
    axes.xaxis.set_major_formatter(FuncFormatter(lambda t, _: _time_label(clock, t, step)))
    what = "time since the first picture" if clock.zero is None else "time of day"
    axes.set_xlabel(f"{what}, {'h:min' if step >= _MINUTE_S else 'h:min:s'}")
    axes.set_xlim(edges[0], edges[-1])


def _time_label(clock: Clock, t: float, step: float) -> str:
    """To what a step of the axis needs: minutes, seconds or tenths of a second."""
    if step >= _MINUTE_S:
        return clock.label(t)
    return clock.moment(t) if step < 1 else clock.moment(t).rpartition(".")[0]


def whole_numbers(axes: Axes) -> None:
    """Few whole numbers at the side, from 0 on."""
    axes.yaxis.set_major_locator(MaxNLocator(4, integer=True))
    axes.set_ylim(0, max(1.0, axes.get_ylim()[1]))


def not_watched(axes: Axes, edges: Floats, coverage: Floats) -> None:
    """Hatch the intervals that nobody watched."""
    for k in np.flatnonzero(coverage <= 0).tolist():
        axes.axvspan(edges[k], edges[k + 1], facecolor="none", edgecolor=GREY, hatch="/////", linewidth=0)
