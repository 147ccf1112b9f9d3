"""How well vehicles are placed on the road: cuboids before pinhole cameras, and the pedestrians of PETS 2009.

    python tools/road_plane.py [GT]

GT is PETS 2009's gt.txt in MOTChallenge form, whose columns 8 and 9 are metres on the ground.
"""

from __future__ import annotations

import sys
from itertools import product
from pathlib import Path

import cv2
import numpy as np

from vidtrack.formats import read_mot
from vidtrack.traffic.calibration.calibrate import calibrated
from vidtrack.traffic.footprint import Footprints
from vidtrack.traffic.site import Site

WIDTH, HEIGHT, FOCAL = 1280, 720, 1000.0
CAMERAS = {"6 m, 15 deg down": (6.0, 15.0), "8 m, 20 deg down": (8.0, 20.0), "12 m, 35 deg down": (12.0, 35.0)}
VEHICLES = {
    "car": (4.5, 1.8, 1.5),
    "van": (5.5, 2.0, 2.2),
    "lorry": (10.0, 2.5, 3.5),
    "pedestrian": (0.5, 0.5, 1.7),
}
HEADINGS = np.radians(np.arange(0, 360, 15))
SPEED, STEP_S = 15.0, 0.02


def picture(camera, xy, z=0.0):
    """(N, 2) px of points (N, 2) m at height z m, seen from (0, 0, height), looking north and down."""
    height, down = camera[0], np.radians(camera[1])
    ahead = xy[:, 1] * np.cos(down) - (z - height) * np.sin(down)
    below = -xy[:, 1] * np.sin(down) - (z - height) * np.cos(down)
    return np.array([WIDTH - 1, HEIGHT - 1]) / 2 + FOCAL * np.column_stack([xy[:, 0], below]) / ahead[:, None]


def silhouette(camera, xy, heading, size):
    """Centroid (2,) and box (4,) of a cuboid of length, width and height."""
    e = np.array([np.sin(heading), np.cos(heading)])
    n = np.array([-e[1], e[0]])
    foot = np.array([xy + a * size[0] / 2 * e + b * size[1] / 2 * n for a, b in product((-1, 1), repeat=2)])
    corners = np.vstack([picture(camera, foot), picture(camera, foot, size[2])])
    m = cv2.moments(cv2.convexHull(corners.astype(np.float32)))
    (left, top), (right, bottom) = corners.min(axis=0), corners.max(axis=0)
    return np.array([m["m10"], m["m01"]]) / m["m00"], np.array([left + 0.5, top + 0.5, right - left, bottom - top])


def site(points, ground, width=WIDTH, height=HEIGHT):
    """A site that is calibrated by these points."""
    calibration = {"picture": np.asarray(points).tolist(), "ground": np.asarray(ground).tolist()}
    return Site.model_validate({"site": {"name": "a", "width": width, "height": height}, "calibration": calibration})


def cuboids():
    """A line for each camera and vehicle: errors over all headings, where the picture's middle rows are."""
    print("camera, vehicle: speed error % (mean, root mean square, largest), with the centroid as if on the road;")
    print("    position error m; length error m")
    P = np.diag([0.1, 0.1, 1.0, 1.0])[None]
    for name, camera in CAMERAS.items():
        middle = camera[0] / np.tan(np.radians(camera[1]))
        grid = np.array([[x, y] for y in (0.75 * middle, 1.1 * middle, 1.5 * middle) for x in (-0.3 * y, 0.3 * y)])
        ground = calibrated(site(picture(camera, np.vstack([grid, [[0, middle]]])), np.vstack([grid, [[0, middle]]])))
        for kind, size in VEHICLES.items():
            rows = []
            for heading, y in product(HEADINGS, (0.85 * middle, 1.1 * middle, 1.35 * middle)):
                at, way = np.array([0.05 * middle, y]), STEP_S * SPEED * np.array([np.sin(heading), np.cos(heading)])
                centroid, box = silhouette(camera, at, heading, size)
                before, after = (silhouette(camera, at + sign * way, heading, size)[0] for sign in (-1, 1))
                u = (after - before) / (2 * STEP_S)
                road, one = Footprints(ground, (WIDTH, HEIGHT)), (np.array([1]), np.zeros(1))
                stand = road.place(*one, centroid[None], u[None], P, box[None])
                plain = np.linalg.norm(ground.metres(after[None]) - ground.metres(before[None])) / (2 * STEP_S)
                off = np.linalg.norm(stand.xy[0] - at)
                rows.append([stand.speed[0] / SPEED - 1, plain / SPEED - 1, off, abs(stand.length[0] - size[0])])
            error = np.array(rows)[np.isfinite(np.array(rows)).all(axis=1)]
            speed, plain = 100 * error[:, 0], 100 * error[:, 1].mean()
            place, length = error[:, 2:].mean(axis=0)
            print(
                f"{name}, {kind}: {speed.mean():+.1f} {np.sqrt(np.mean(speed**2)):.1f} {np.abs(speed).max():.1f}, "
                f"{plain:+.1f}; {place:.2f}; {length:.2f} ({len(error)} of {len(rows)})"
            )


def pedestrians(path):
    """Calibrated by every so many rows; the others by the middle of the box's lower edge."""
    table, metres = read_mot(path), np.loadtxt(path, delimiter=",")[:, 7:9]
    box = table.box - [1, 1, 0, 0]  # MOTChallenge counts pixels from 1
    whole = (box[:, 0] > 2) & (box[:, 0] + box[:, 2] < 766) & (box[:, 1] + box[:, 3] < 574)
    box, metres = box[whole], metres[whole]
    feet = np.column_stack([box[:, 0] + (box[:, 2] - 1) / 2, box[:, 1] + box[:, 3] - 0.5])
    some = np.arange(0, len(feet), len(feet) // 30)
    ground = calibrated(site(feet[some], metres[some], 768, 576))
    off = np.delete(np.linalg.norm(ground.metres(ground.inside(feet)) - metres, axis=1), some)
    print(
        f"PETS 2009, {len(some)} rows calibrate, {np.isfinite(off).sum()} of {len(off)} others are inside: "
        f"median {np.nanmedian(off):.3f} m, 95 % {np.nanpercentile(off, 95):.3f} m; "
        f"camera {ground.pose().height_m:.1f} m high, focal length {ground.pose().focal_px:.0f} px"
    )
    speeds(table, whole, box, metres, ground)


def speeds(table, whole, box, metres, ground, span=3, rate=7.0):
    """Speeds from the boxes' middles over 2 x span frames, beside those of the positions in metres."""
    identity, frame = table.id[whole], table.frame[whole]
    middle, rows, u, v = box[:, :2] + (box[:, 2:] - 1) / 2, [], [], []
    for one in np.unique(identity):
        own = np.flatnonzero(identity == one)
        own = own[np.argsort(frame[own])]
        first, at, last = own[: -2 * span], own[span:-span], own[2 * span :]
        time = ((frame[last] - frame[first]) / rate)[:, None]
        rows.append(at)
        u.append((middle[last] - middle[first]) / time)
        v.append((metres[last] - metres[first]) / time)
    rows, u, v = np.concatenate(rows), np.concatenate(u), np.concatenate(v)
    order = np.argsort(frame[rows], kind="stable")
    rows, u, v = rows[order], u[order], v[order]
    P = np.repeat(np.diag([0.25, 0.25, 1.0, 1.0])[None], len(rows), axis=0)
    stand = Footprints(ground, (768, 576)).place(identity[rows], frame[rows] / rate, middle[rows], u, P, box[rows])
    true = np.linalg.norm(v, axis=1)
    walking = (true > 0.5) & np.isfinite(stand.speed)
    steps = 0.1 * u[walking]
    here = middle[rows][walking]
    plain = np.linalg.norm(ground.metres(here + steps) - ground.metres(here - steps), axis=1) / 0.2
    ours = stand.speed[walking] / true[walking]
    print(
        f"speeds of {walking.sum()} rows over the truth's: median {np.median(ours):.3f}; the box's middle as if on the "
        f"road: {np.median(plain / true[walking]):.3f}; median absolute error "
        f"{np.median(np.abs(stand.speed[walking] - true[walking])):.3f} m/s of {np.median(true[walking]):.2f} m/s"
    )


if __name__ == "__main__":
    cuboids()
    if len(sys.argv) > 1:
        pedestrians(Path(sys.argv[1]))
