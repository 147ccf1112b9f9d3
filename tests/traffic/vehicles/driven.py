"""Cuboids that drive before an exact camera: the edges of their boxes as rows of a track."""

import numpy as np
from pinhole import POINTS, Pinhole, site_of

from vidtrack.traffic.calibration.calibrate import calibrated

CAMERA = Pinhole()
GROUND = calibrated(site_of(CAMERA.picture(POINTS), POINTS, sigma_picture_px=0.5))
CAR, VAN, LORRY, BIKE, WALKER = (4.3, 1.75, 1.3), (5.6, 2.0, 2.3), (9.0, 2.5, 3.3), (2.1, 0.75, 1.5), (0.5, 0.5, 1.7)
RATE = 25.0


def edges_of(xy, heading, size):
    """(N, 4) exact edges [px] of cuboids at xy (N, 2) m; heading (N,) clockwise from north."""
    boxes = np.array([CAMERA.vehicle(at, angle, *size)[1] for at, angle in zip(xy, heading, strict=True)])
    return np.column_stack([boxes[:, :2], boxes[:, :2] + boxes[:, 2:]]) - 0.5


def straight(start, heading, speed, seconds):
    """Times (N,), places (N, 2) and headings (N,) of a vehicle that keeps its speed [m/s]."""
    t = np.arange(round(seconds * RATE)) / RATE
    along = np.array([np.sin(heading), np.cos(heading)])
    return t, np.asarray(start, float) + speed * t[:, None] * along, np.full(len(t), heading)


def arc(middle, radius, speed, seconds, begin):
    """The same on a circle, clockwise from the angle `begin` [rad from north]."""
    t = np.arange(round(seconds * RATE)) / RATE
    angle = begin + speed / radius * t
    return t, np.asarray(middle) + radius * np.column_stack([np.sin(angle), np.cos(angle)]), angle + np.pi / 2
