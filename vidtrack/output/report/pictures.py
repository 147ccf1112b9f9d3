"""Pictures of the place: where vehicles came from and went to, and where they were for how long."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.patches import FancyArrowPatch, Polygon
from matplotlib.path import Path as Curve
from matplotlib.ticker import FuncFormatter, LogLocator

from vidtrack.arrays.types import Floats
from vidtrack.output.report.style import BLUE, GREY, INK, PALE, SIGNAL, WIDTH, drawing, png
from vidtrack.traffic.measures.gates import Gates
from vidtrack.traffic.report.paths import Heat
from vidtrack.traffic.report.sheet import Sheet
from vidtrack.traffic.site import Gate, Site
from vidtrack.video.frame import Image

_WIDEST = 9.0
"""pt; of the arrow of the movement with most trips"""
_PALER = 0.55
"""How far the scene is mixed with white, so that arrows and names can be read on it"""
_NAME: dict[str, Any] = {
    "fontsize": 7.5,
    "color": INK,
    "bbox": {"facecolor": "white", "edgecolor": GREY, "linewidth": 0.4, "pad": 1.5},
}


def origins(site: Site, sheet: Sheet, scene: Image | None) -> bytes:
    """Arrows from the entry gates to the exit gates, as wide as trips are many, over the scene if there is one."""
    width, height = site.camera.width, site.camera.height
    left, top, right, bottom = (0.0, 0.0, width, height) if scene is not None else _around_gates(site)
    with drawing(WIDTH * (bottom - top) / (right - left)) as (figure, axes):
        axis = axes[0, 0]
        if scene is not None:
            grey = cv2.cvtColor(scene, cv2.COLOR_BGR2GRAY)
            pale = 255 - (1 - _PALER) * (255 - grey.astype(float))
            axis.imshow(pale, cmap="gray", vmin=0, vmax=255, extent=(-0.5, width - 0.5, height - 0.5, -0.5))
        else:
            for zone in site.zones.values():
                axis.add_patch(Polygon(zone.polygon, facecolor=PALE, alpha=0.5, edgecolor="none"))
        most = max(1.0, float(sheet.sums.max(initial=0)))
        for movement, trips in sorted(
            zip(sheet.movements, sheet.sums.tolist(), strict=True), key=lambda pair: -pair[1]
        ):
            ends = _middle(site, movement.start, "entry"), _middle(site, movement.end, "exit")
            if trips > 0 and ends[0] is not None and ends[1] is not None:
                _arrow(axis, ends[0], ends[1], site, _WIDEST * trips / most, f"{trips:.0f}")
        for gate in site.gates.values():
            if gate.role != "neutral":
                axis.plot(*np.array(gate.line).T, color=INK, linewidth=2, solid_capstyle="butt")
        for leg in site.legs:
            _write_leg(axis, site, leg)
        axis.set_xlim(left - 0.5, right - 0.5)
        axis.set_ylim(bottom - 0.5, top - 0.5)
        _bare(axis)
        return png(figure)


def heat_map(heat: Heat, gates: Gates, metres: bool) -> bytes:
    """Vehicle-seconds on the road, on a logarithmic scale, with the gates."""
    extent = np.ptp(heat.y) / np.ptp(heat.x)
    with drawing(min(max((WIDTH - 1.3) * extent + 0.5, 2.0), 6.5)) as (figure, axes):
        axis = axes[0, 0]
        seconds = np.ma.masked_less_equal(heat.seconds, 0)
        most = max(float(heat.seconds.max()), 1e-3)
        norm = LogNorm(max(most / 1000, float(seconds.min()) if seconds.count() else most / 10), most * 1.001)
        drawn = axis.pcolormesh(heat.x, heat.y, seconds, cmap="YlGnBu", norm=norm, rasterized=True)
        for x1, y1, x2, y2 in gates.segment.tolist():
            axis.plot([x1, x2], [y1, y2], color=SIGNAL, linewidth=1.2)
        for leg in dict.fromkeys(gates.legs):
            ours = np.concatenate(
                [gates.segment[gates.first[g] : gates.first[g + 1]] for g in range(len(gates)) if gates.legs[g] == leg]
            )
            axis.text(*ours.reshape(-1, 2).mean(axis=0).tolist(), leg, ha="center", va="center", **_NAME)
        axis.set_aspect("equal")
        axis.set_xlim(heat.x[0], heat.x[-1])
        axis.set_ylim(*((heat.y[0], heat.y[-1]) if metres else (heat.y[-1], heat.y[0])))
        unit = "m" if metres else "px"
        axis.set_xlabel(f"x, {unit}")
        axis.set_ylabel(f"y, {unit}")
        side = heat.x[1] - heat.x[0]
        label = f"vehicle-seconds\nin {side:.2g} x {side:.2g} {unit}"
        plain = FuncFormatter(lambda s, _: f"{s:g}")
        ticks = LogLocator(subs=(1.0, 2.0, 5.0))
        scale = figure.colorbar(drawn, ax=axis, shrink=0.8, label=label, ticks=ticks, format=plain)
        scale.minorticks_off()  # their labels would be TeX
        return png(figure)


def _around_gates(site: Site) -> tuple[float, float, float, float]:
    """Left, top, right, bottom in px: the gates with some room, where there is no scene to see the rest of."""
    points = np.array([point for gate in site.gates.values() for point in gate.line])
    low, high = points.min(axis=0), points.max(axis=0)
    room = 0.12 * (high - low).max()
    (left, top), (right, bottom) = (low - room).tolist(), (high + room).tolist()
    return left, top, right, max(bottom, top + 0.4 * (right - left))


def _arrow(axis: Axes, start: Floats, end: Floats, site: Site, width: float, label: str) -> None:
    """A curve that leaves and arrives on the line through the middle of the site."""
    centre = np.mean([np.mean(gate.line, axis=0) for gate in site.gates.values() if gate.role != "neutral"], axis=0)
    bend = centre + 0.15 * ((start + end) / 2 - centre)
    curve = Curve([start, bend, end], [Curve.MOVETO, Curve.CURVE3, Curve.CURVE3])
    head = 3 + 1.1 * width
    style = f"-|>,head_length={head / 10:.2f},head_width={head / 16:.2f}"
    axis.add_patch(
        FancyArrowPatch(
            path=curve, arrowstyle=style, mutation_scale=10, linewidth=max(width, 0.6), color=BLUE, alpha=0.55,
            shrinkA=0, shrinkB=0, capstyle="butt", joinstyle="miter",
        )
    )  # fmt: skip
    t = 0.72
    at = (1 - t) ** 2 * start + 2 * t * (1 - t) * bend + t**2 * end
    box = {"facecolor": "white", "edgecolor": "none", "alpha": 0.8, "pad": 0.6}
    axis.text(at[0], at[1], label, fontsize=6.5, ha="center", va="center", color=INK, zorder=5, bbox=box)


def _middle(site: Site, leg: str, role: str) -> Floats | None:
    """(2,) px; of the gates of a leg where vehicles enter, or leave; None: there are none."""
    ours = [np.mean(gate.line, axis=0) for gate in _gates_of_leg(site, leg) if gate.role in (role, "both")]
    return np.asarray(np.mean(ours, axis=0)) if ours else None


def _gates_of_leg(site: Site, leg: str) -> list[Gate]:
    return [gate for name, gate in site.gates.items() if (gate.leg or name) == leg]


def _write_leg(axis: Axes, site: Site, leg: str) -> None:
    x, y = np.mean([np.mean(gate.line, axis=0) for gate in _gates_of_leg(site, leg)], axis=0)
    axis.text(x, y, leg, ha="center", va="center", zorder=6, **_NAME)


def _bare(axis: Axes) -> None:
    axis.set_xticks([])
    axis.set_yticks([])
    for spine in axis.spines.values():
        spine.set_visible(True)
