"""Measurement errors correlated in time: many measurements in a short time are worth no more than a few."""

from __future__ import annotations

LASTING_S = 0.5
"""s; correlation time of what a detector misses or adds at a vehicle's ends. In the simulated junction the errors of
single blobs' centroids decorrelate within half a second as far as they ever do; the rest stays for seconds."""


def inflation(dt: float) -> float:
    """Factor on the variance of lasting errors in a filter that assumes independent errors in scans dt seconds apart.

    Errors of variance R and correlation time T have the spectral density 2 T R at frequency zero, and so have
    independent errors of variance 2 T R / dt. A second of video then carries the same information at all frame rates.
    The factor is never below one, and one for a first scan (dt = 0).
    """
    return max(1.0, 2 * LASTING_S / dt) if dt > 0 else 1.0
