"""Errors that last: many measurements in a short time are worth no more than a few."""

from __future__ import annotations

LASTING_S = 0.5
"""s; correlation time of what a detector misses or adds at a vehicle's ends. In the simulated junction the error of
lone blobs' centroids loses within half a second all that it ever loses; the rest stays for seconds."""


def inflation(dt: float) -> float:
    """How many times a variance must be larger in a filter that takes the errors of scans dt seconds apart for new.

    Errors of variance R and correlation time T have the spectral density 2 T R at frequency zero; so have independent
    ones of variance 2 T R / dt. A second of video then tells the same at all frame rates. Never below one; one for a
    first scan, which comes after no other (dt = 0).
    """
    return max(1.0, 2 * LASTING_S / dt) if dt > 0 else 1.0
