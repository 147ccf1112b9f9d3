"""A pinhole camera above a road, with exact homographies, and the boxes of vehicles in its pictures."""

from dataclasses import dataclass

import cv2
import numpy as np

from vidtrack.traffic.site import Site

WIDTH, HEIGHT = 1280, 720
POINTS = np.array([[-6, 12], [6, 12], [-8, 25], [8, 25], [-12, 48], [12, 48], [0, 18], [3, 33.0]])
"""m; on the road, in the picture of the camera below"""


@dataclass(frozen=True)
class Pinhole:
    """At (0, 0, height), looking north and down by `pitch_deg`."""

    height: float = 8.0
    pitch_deg: float = 20.0
    focal: float = 1000.0

    def picture(self, xy, z=0.0):
        """(N, 2) px of points at (N, 2) m and height z m."""
        xy = np.atleast_2d(np.asarray(xy, float))
        down = np.radians(self.pitch_deg)
        ahead = xy[:, 1] * np.cos(down) - (z - self.height) * np.sin(down)
        below = -xy[:, 1] * np.sin(down) - (z - self.height) * np.cos(down)
        middle = np.array([(WIDTH - 1) / 2, (HEIGHT - 1) / 2])
        return middle + self.focal * np.column_stack([xy[:, 0], below]) / ahead[:, None]

    def vehicle(self, xy, heading, length, width, height):
        """Centroid (2,) and box (4,) of the silhouette of a cuboid; `heading` radians clockwise from north."""
        e = np.array([np.sin(heading), np.cos(heading)])
        n = np.array([-e[1], e[0]])
        foot = np.array([xy + a * length / 2 * e + b * width / 2 * n for a in (-1, 1) for b in (-1, 1)])
        corners = np.vstack([self.picture(foot), self.picture(foot, height)])
        m = cv2.moments(cv2.convexHull(corners.astype(np.float32)))
        (left, top), (right, bottom) = corners.min(axis=0), corners.max(axis=0)
        box = np.array([left + 0.5, top + 0.5, right - left, bottom - top])
        return np.array([m["m10"], m["m01"]]) / m["m00"], box


def site_of(picture, ground, **calibration):
    """A site with these points."""
    points = {"picture": np.asarray(picture).tolist(), "ground": np.asarray(ground).tolist()}
    return Site.model_validate(
        {"site": {"name": "road", "width": WIDTH, "height": HEIGHT}, "calibration": points | calibration}
    )
