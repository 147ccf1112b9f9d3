"""A road's clip as files: the video, its truth in the picture and on the ground, its events, and its site."""

from __future__ import annotations

import csv
from collections.abc import Iterable
from dataclasses import astuple, fields
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays.types import Floats
from vidtrack.simulate.roads.clip import START, RoadClip
from vidtrack.simulate.roads.events import Event, events, shown_gates
from vidtrack.simulate.roads.layout import GroundGate
from vidtrack.simulate.roads.scenery import on_picture
from vidtrack.simulate.roads.vehicles import CLASS_BOUNDS_M, KINDS
from vidtrack.simulate.video_write import write_truth, write_video

TRUTH_COLUMNS = (
    *("frame", "time_s", "target_id", "x_m", "y_m", "speed_kmh", "heading_deg"),
    *("class", "length_m", "width_m"),
)
GROUND_SIGMA_M = 0.02
ZONE_STEP_M = 4.0  # between the corners of a zone: a lens bends its edges
LEAST_SIGMA_PX = 0.01  # points are written to a hundredth of a pixel
HALF_PX = 0.5  # files name the centre of the upper left pixel (0, 0), as tracks do


def write_road(clip: RoadClip, folder: Path, frames: Iterable[NDArray[np.uint8]] | None = None) -> None:
    """Write all files into a folder that exists; `frames` stands in for the clip (a progress bar)."""
    write_video(folder / "video.avi", clip if frames is None else frames, clip.size, clip.fps)
    write_truth(folder / "gt.txt", clip.truth.boxes)
    write_road_truth(folder / "road_truth.csv", clip)
    write_events(folder / "road_events.csv", events(clip))
    (folder / "site.toml").write_text(site_toml(clip), encoding="utf-8")


def write_road_truth(path: Path, clip: RoadClip) -> None:
    """Write the states on the ground, one row for each row of gt.txt, in its order."""
    truth, fleet = clip.truth, clip.fleet
    degrees = np.mod(np.degrees(truth.heading), 360)
    with path.open("w", newline="", encoding="utf-8") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(TRUTH_COLUMNS)
        for n, vehicle in enumerate(truth.vehicle):
            numbers = *truth.xy[n], 3.6 * truth.speed[n], degrees[n]
            row = [truth.boxes.frame[n] + 1, f"{truth.boxes.time_s[n]:.6f}", truth.boxes.id[n]]
            row += [f"{number:.4f}" for number in numbers]
            row += [KINDS[fleet.kind[vehicle]].name, f"{fleet.length[vehicle]:.3f}", f"{fleet.width[vehicle]:.3f}"]
            table.writerow(row)


def write_events(path: Path, found: list[Event]) -> None:
    """Write one row an event; a column that does not apply is empty."""
    with path.open("w", newline="", encoding="utf-8") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(column.name for column in fields(Event))
        for event in found:
            table.writerow(f"{cell:.4f}" if isinstance(cell, float) else cell for cell in astuple(event))


def site_toml(clip: RoadClip) -> str:
    """The site as a user would describe it: gates and zones in px, and clicked points with their errors."""
    layout, (width, height) = clip.layout, clip.size
    lines = [
        "[site]",
        f'name = "{clip.name}"',
        f"start = {START.isoformat()}",
        f"width = {width}",
        f"height = {height}",
    ]
    lines += ["", *_calibration(clip)]
    gates = shown_gates(clip)
    for name, gate in gates.items():
        line = _px(clip, _bent(clip, gate))
        lines += ["", f"[gates.{name}]", f"line = {line}", f'leg = "{gate.leg}"', f'role = "{gate.role}"']
    for name, polygon in layout.zones.items():
        corners = _clipped(on_picture(polygon, clip.eye, ZONE_STEP_M), clip.size)
        if len(corners) > 2:
            lines += ["", f"[zones.{name}]", f"polygon = {_points(corners - HALF_PX)}"]
    for name, (start, end, length) in layout.sections.items():
        if start in gates and end in gates:
            lines += ["", f"[sections.{name}]", f'from = "{start}"', f'to = "{end}"', f"length_m = {length}"]
    legs = {gate.leg for gate in gates.values()}
    allowed = ", ".join(f'["{a}", "{b}"]' for a, b in layout.movements if {a, b} <= legs)
    lines += ["", "[movements]", f"allowed = [{allowed}]", "", "[classes]"]
    lines += [f"{name} = [{low}, {high}]" for name, (low, high) in CLASS_BOUNDS_M.items()]
    return "\n".join([*lines, "", "[report]", "interval_s = 900", ""])


def _calibration(clip: RoadClip) -> list[str]:
    ground = clip.layout.survey[clip.eye.shows(clip.layout.survey, clip.size)]
    rng = np.random.default_rng((clip.seed, 9))
    clicked = clip.eye.project(np.column_stack([ground, np.zeros(len(ground))]))[0] - HALF_PX
    clicked += clip.click_sigma * rng.standard_normal(clicked.shape)
    clicked = np.clip(clicked, 0, np.array(clip.size) - 1)
    surveyed = ground + GROUND_SIGMA_M * rng.standard_normal(ground.shape)
    lines = ["[calibration]", f"picture = {_points(clicked)}", f"ground = {_points(surveyed, 3)}"]
    lines += [f"sigma_picture_px = {max(clip.click_sigma, LEAST_SIGMA_PX)}", f"sigma_ground_m = {GROUND_SIGMA_M}"]
    lines += [f"camera_height_m = {float(clip.eye.position[2])}"]
    if clip.eye.k1 != 0:
        x, y = clip.eye.centre - HALF_PX
        lines += [f"distortion = [{clip.eye.k1}, 0.0]", f"focal_px = {clip.eye.focal:.3f}", f"center = [{x}, {y}]"]
    return lines


def _bent(clip: RoadClip, gate: GroundGate) -> Floats:
    """The gate's line (V, 2) m, with more points where the lens bends it."""
    count = 2 if clip.eye.k1 == 0 else 5
    return gate.line[0] + np.linspace(0, 1, count)[:, None] * (gate.line[1] - gate.line[0])


def _px(clip: RoadClip, ground: Floats) -> str:
    return _points(clip.eye.project(np.column_stack([ground, np.zeros(len(ground))]))[0] - HALF_PX)


def _clipped(polygon: Floats, size: tuple[int, int]) -> Floats:
    """A polygon (V, 2) px cut at the picture's edges, one after the other (Sutherland and Hodgman)."""
    for axis, sign, limit in ((0, 1.0, 0.5), (0, -1.0, 0.5 - size[0]), (1, 1.0, 0.5), (1, -1.0, 0.5 - size[1])):
        depth = sign * polygon[:, axis] - limit if len(polygon) else np.empty(0)
        kept = []
        for a, b, da, db in zip(polygon, np.roll(polygon, -1, axis=0), depth, np.roll(depth, -1), strict=True):
            kept += [a] if da >= 0 else []
            kept += [a + da / (da - db) * (b - a)] if (da >= 0) != (db >= 0) else []
        polygon = np.array(kept).reshape(-1, 2)
    return polygon


def _points(xy: Floats, decimals: int = 2) -> str:
    return "[" + ", ".join(f"[{x:.{decimals}f}, {y:.{decimals}f}]" for x, y in xy) + "]"
