"""Blobs: the connected regions of a foreground, their moments, and what of them belongs together."""

from __future__ import annotations

from dataclasses import dataclass

import numba
import numpy as np

from vidtrack.config import BlobSettings
from vidtrack.scan import Floats, Scan
from vidtrack.video.foreground import Foreground
from vidtrack.video.runs import connect, find_runs


@dataclass(frozen=True, slots=True)
class Blobs:
    """Connected regions in source pixels; a pixel is a unit square around its integer position.

    centroid   (B, 2) x, y
    cov        (B, 2, 2) second central moments of the region
    box        (B, 4) left, top, width, height
    area       (B,)
    amplitude  (B,) mean strength
    R          (B, 2, 2) covariance of the centroid as a measurement
    """

    centroid: Floats
    cov: Floats
    box: Floats
    area: Floats
    amplitude: Floats
    settings: BlobSettings
    step: int

    def __len__(self) -> int:
        return len(self.area)
