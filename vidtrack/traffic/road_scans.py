"""Blobs of a calibrated camera as measurements in metres: where on the road each blob's vehicle stands."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vidtrack.arrays.types import Floats, Mask
from vidtrack.estimate.noise import LASTING_S
from vidtrack.scan import Scan
from vidtrack.tracks import Tracks
from vidtrack.traffic.boxes import within
from vidtrack.traffic.calibration.ground import Ground
from vidtrack.traffic.footprint import Footprints

UNKNOWN_PX_S = 1e3
"""px/s; standard deviation of the velocity of a blob without a track."""
EDGE_PX = 1.5
"""Processed pixels; standard deviation of the edges of a blob, which shadow and the like move for seconds."""
LAMP_M, LAMP_S = 1.2, 2.0
"""m, s; what lamps light by night is so far from the vehicle in each direction (standard deviation), for so long."""
CELL_PX = 16.0
"""px; side of the squares by which the area of the picture on the road is added up."""


@dataclass(frozen=True, slots=True)
class InPicture:
    """The part of the road that a camera shows and its calibration covers.

    ground  the calibrated picture, size (width, height) px
    """

    ground: Ground
    size: tuple[int, int]

    def share(self, xy: Floats) -> Floats:
        """(T,) 1 at positions (T, 2) [m] in the picture, 0 at others."""
        with np.errstate(invalid="ignore", divide="ignore"):
            pixels = self.ground.pixels(xy)
            ahead = self.ground.depth(xy) * self._sign() > 0
            shown = np.asarray(((pixels > 0) & (pixels < np.array(self.size) - 1)).all(axis=1))
            covered = ~np.isnan(self.ground.inside(np.where(shown[:, None], pixels, -1e6))[:, 0])
        return (ahead & shown & covered).astype(float)

    def area(self) -> float:
        """m^2 of road in the picture."""
        axes = (np.arange(CELL_PX / 2, side, CELL_PX) for side in self.size)
        pixels = np.stack(np.meshgrid(*axes), axis=-1).reshape(-1, 2)
        metres = self.ground.metres(self.ground.inside(pixels))
        metres = metres[~np.isnan(metres[:, 0])]
        return float(CELL_PX**2 * np.abs(np.linalg.det(self.ground.by_own_error(metres))).sum())

    def _sign(self) -> float:
        """The sign of depths in front of the camera."""
        return float(np.sign(self.ground.depth(self.ground.plane.origin[None])[0]))


class RoadScans:
    """Scans in metres from the blobs of a video run with the tracks that took them.

    ground  the calibrated picture, size (width, height) px
    """

    def __init__(self, ground: Ground, size: tuple[int, int]) -> None:
        self._ground = ground
        self._footprints = Footprints(ground, size)

    def scan(self, blobs: Scan, tracks: Tracks, vehicles: Floats, station: int, *, dark: bool = False) -> Scan:
        """The blobs of one vehicle each, on the road; those that the calibration does not cover are left out.

        Several share a blob if the camera's tracks do, or if more than one of the vehicles (K, 2) [m] that all sensors
        together know of stands in its box: of those in a queue the camera may take two for one. The heading of a
        vehicle is that of its track. R is the error of the border, of the vehicle's shape and heading, and of the
        calibration; all but the first last from picture to picture. In the dark a blob shows what lamps light, which
        moves with the vehicle.
        """
        assert blobs.box is not None, "blobs have boxes"
        owner = np.full(len(blobs), -1)
        taken = np.flatnonzero(tracks.measurement >= 0)
        owner[tracks.measurement[taken]] = taken
        alone = owner < 0
        alone[owner >= 0] = tracks.group[owner[owner >= 0]] < 0
        box = within(np.hstack([blobs.z + blobs.box[:, :2], blobs.box[:, 2:]]), blobs.rim)
        rows = np.flatnonzero(alone & (self._shown(vehicles, box).sum(axis=1) < 2))
        owner, known = owner[rows], owner[rows] >= 0
        u, P, name = np.zeros((len(rows), 2)), np.zeros((len(rows), 4, 4)), -1 - np.arange(len(rows))
        P[:, 2, 2] = P[:, 3, 3] = UNKNOWN_PX_S**2
        plane = [*tracks.position, *tracks.velocity]
        u[known] = tracks.v[owner[known]]
        P[known] = tracks.P[owner[known]][:, plane][:, :, plane]
        P[:, :2, 2:] = P[:, 2:, :2] = 0.0
        P[:, :2, :2] = blobs.R[rows]
        name[known] = tracks.id[owner[known]]
        stand = self._footprints.place(name, np.full(len(rows), blobs.t), blobs.z[rows], u, P, box[rows])
        good = np.isfinite(stand.xy).all(axis=1) & np.isfinite(stand.xy_own).all(axis=(1, 2))
        xy, own, shared = stand.xy[good], stand.xy_own[good], stand.xy_shared[good]
        K = self._ground.by_own_error(xy)
        edges = (EDGE_PX * blobs.pixel) ** 2 * K @ K.transpose(0, 2, 1)
        R = own + edges + shared @ shared.transpose(0, 2, 1)
        lasting = R - K @ blobs.R[rows[good]] @ K.transpose(0, 2, 1)
        if dark:  # errors that last longer weigh in proportion
            lamps = LAMP_M**2 * np.eye(2)
            R, lasting = R + lamps, lasting + LAMP_S / LASTING_S * lamps
        return Scan(blobs.t, xy, R, lasting=lasting, noise=np.eye(2), station=station)

    def _shown(self, vehicles: Floats, box: Floats) -> Mask:
        """(N, K) whether vehicles (K, 2) [m] stand in boxes (N, 4) of the picture."""
        at = self._ground.pixels(vehicles) - box[:, None, :2]
        return np.asarray(((at > 0) & (at < box[:, None, 2:])).all(axis=2))
