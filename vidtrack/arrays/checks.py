"""Checks of measurements and states: finite numbers, positive definite covariances."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from vidtrack.compiled import kernel
from vidtrack.errors import ScanError

if TYPE_CHECKING:
    from vidtrack.arrays.types import Floats


@kernel
def _surely_usable(z: Floats, R: Floats) -> bool:
    """Fast sufficient check: all measurements in the plane are finite and their covariances positive definite."""
    for i in range(len(z)):
        xx, yy, xy = R[i, 0, 0], R[i, 1, 1], R[i, 0, 1]
        finite = np.isfinite(z[i, 0]) and np.isfinite(z[i, 1]) and np.isfinite(xx + yy + xy)
        if not (finite and xx > 0 and xy == R[i, 1, 0] and xx * yy - xy * xy > 1e-12 * max(xx, yy) ** 2):
            return False
    return True


def check_measurements(z: Floats, R: Floats) -> None:
    """Raise ScanError naming the first measurement that is not finite or has an invalid covariance."""
    if z.shape[1] == 2 and _surely_usable(z, R):
        return
    finite = np.isfinite(z).all(axis=1) & np.isfinite(R).all(axis=(1, 2))
    if not finite.all():
        i = int(np.argmin(finite))
        raise ScanError(f"measurement {i} is not finite: z={z[i]}, R={R[i].tolist()}; drop it before the scan is made")
    check_covariances(R, "R of measurement {}")


def check_states(x: Floats, P: Floats) -> None:
    """Raise ScanError naming the first invalid state of x (B, n), P (B, n, n)."""
    finite = np.isfinite(x).all(axis=1)
    if not finite.all():
        i = int(np.argmin(finite))
        raise ScanError(f"state {i} is not finite: {x[i]}")
    check_covariances(P, "P of state {}", least=-1e-9)  # a component may be known exactly


def check_covariances(R: Floats, name: str, least: float = 1e-14) -> None:
    """Raise ScanError for the first of R (B, m, m) that is not a covariance; {} in `name` becomes its index.

    least  every eigenvalue must exceed this share of the largest element
    """
    finite = np.isfinite(R).all(axis=(1, 2))
    if not finite.all():
        i = int(np.argmin(finite))
        raise ScanError(f"{name.format(i)} is not finite: {R[i].tolist()}")
    scale = np.abs(R).max(axis=(1, 2), initial=np.finfo(float).tiny)
    symmetric = np.abs(R - np.swapaxes(R, 1, 2)).max(axis=(1, 2), initial=0.0) <= 1e-9 * scale
    if not symmetric.all():
        i = int(np.argmin(symmetric))
        raise ScanError(f"{name.format(i)} is not symmetric: {R[i].tolist()}")
    if R.shape[1] == 2:  # the common case, in closed form
        determinant = R[:, 0, 0] * R[:, 1, 1] - R[:, 0, 1] * R[:, 1, 0]
        positive = (R[:, 0, 0] > least * scale) & (determinant > least * scale**2)
    else:
        smallest = np.linalg.eigvalsh(R)[:, 0] if len(R) else np.empty(0)
        positive = smallest > least * scale
    if not positive.all():
        i = int(np.argmin(positive))
        raise ScanError(f"{name.format(i)} is not positive definite: {R[i].tolist()}; give it a variance above zero")
