"""What moves in the picture: how large it is, how much of it there is, and where it goes nowhere."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from vidtrack.config import Settings
from vidtrack.doctor.findings import Objects
from vidtrack.output.sink import Step
from vidtrack.pipeline import has_driven
from vidtrack.scan import TENTATIVE
from vidtrack.tracking.boxes import longer
from vidtrack.video.foreground import Foreground
from vidtrack.video.runs import find_runs  # noqa: F401

_SETTLE_S = 2.0  # in which what stood in the first picture comes out of the scene
_OFTEN = 0.2  # share of the frames
_SMALL = 10  # percentile
FINE_MAJORITY_PX, FINE_AREA_PX = 3, 6
