"""The lens: pictures in which straight lines are straight (D. C. Brown, Decentering distortion of lenses, 1966)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vidtrack.arrays.types import Floats
from vidtrack.traffic.site import Site

_ROUNDS = 20


@dataclass(frozen=True, slots=True)
class Lens:
    """Radial distortion r' = r (1 + k1 r^2 + k2 r^4), r and r' distances from `center` in focal lengths."""

    k1: float
    k2: float
    focal_px: float
    center: tuple[float, float]

    @property
    def bends(self) -> bool:
        """Whether there is any distortion."""
        return (self.k1, self.k2) != (0, 0)

    def straight(self, xy: Floats) -> Floats:
        """(N, 2) picture points [px] without the distortion; NaN beyond the radius at which the picture folds back."""
        bent = (xy - self.center) / self.focal_px
        wanted = np.linalg.norm(bent, axis=1)
        r = wanted.copy()
        for _ in range(_ROUNDS):  # Newton
            r -= (r * self._gain(r) - wanted) / self._slope(r)
        solved = (self._slope(r) > 0) & (np.abs(r * self._gain(r) - wanted) < 1e-9 * (1 + wanted))
        gain = np.where(solved, self._gain(r), np.nan)
        return self.center + self.focal_px * bent / gain[:, None]

    def bent(self, xy: Floats) -> Floats:
        """(N, 2) points of an undistorted picture [px] as the lens shows them."""
        straight = (xy - self.center) / self.focal_px
        gain = self._gain(np.linalg.norm(straight, axis=1))
        return self.center + self.focal_px * straight * gain[:, None]

    def jacobian(self, xy: Floats) -> Floats:
        """(N, 2, 2) derivative of `bent` at points of an undistorted picture."""
        straight = (xy - self.center) / self.focal_px
        r2 = np.sum(straight**2, axis=1)
        outer = straight[:, :, None] * straight[:, None, :]
        turning = (2 * self.k1 + 4 * self.k2 * r2)[:, None, None] * outer
        return self._gain(np.sqrt(r2))[:, None, None] * np.eye(2) + turning

    def by_k1(self, xy: Floats) -> Floats:
        """(N, 2) derivative of `bent` with respect to k1 at points of an undistorted picture [px]."""
        straight = (xy - self.center) / self.focal_px
        return np.asarray(self.focal_px * straight * np.sum(straight**2, axis=1)[:, None])

    def straightening(self, xy: Floats) -> Floats:
        """(N, 2) derivative of `straight` with respect to k1, where it gives these points of an undistorted picture."""
        return np.asarray(-np.linalg.solve(self.jacobian(xy), self.by_k1(xy)[:, :, None])[:, :, 0])

    def _gain(self, r: Floats) -> Floats:
        return 1 + self.k1 * r**2 + self.k2 * r**4

    def _slope(self, r: Floats) -> Floats:
        return 1 + 3 * self.k1 * r**2 + 5 * self.k2 * r**4


def lens_of(site: Site) -> Lens:
    """The lens that a site states; without distortion where it states none, or leaves it to the points."""
    calibration = site.calibration
    assert calibration is not None
    k1, k2 = calibration.distortion if isinstance(calibration.distortion, tuple) else (0.0, 0.0)
    return Lens(k1, k2, calibration.focal_px or site.camera.width, site.center)
