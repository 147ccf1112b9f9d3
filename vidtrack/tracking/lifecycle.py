"""The life of a track: when it is believed, and when it is given up."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vidtrack.errors import ConfigError
from vidtrack.scan import MERGED, TENTATIVE, Floats
from vidtrack.tracking.register import Register

Mask = np.ndarray


@dataclass(frozen=True, slots=True)
class LifeCycle:
    """M-of-N confirmation and deletion by time.

    confirm_hits, confirm_window   M hits within the last N scans confirm, the initiating hit counted
                                   (the P(Bin(N-1, p) >= M-1) convention of SPEC 001); more than N - M
                                   misses among them end a tentative track
    confirm_s       s; a track is not confirmed before this age, so that a high scan rate does not confirm noise
    confirm_travel  object sizes; nor before it has moved this far (swaying trees do not travel)
    coast_s         s; a confirmed track is deleted this long after its last evidence; None: by misses only
    hidden_s        s; the same for a track inside a blob that it shares, where nothing could be seen of it
    coast_scans     or after this many scans without evidence in a row; None: by time only
    """

    confirm_hits: int = 3
    confirm_window: int = 4
    confirm_s: float = 0.0
    confirm_travel: float = 0.0
    coast_s: float | None = None
    hidden_s: float = 2.0
    coast_scans: int | None = 5

    def __post_init__(self) -> None:
        if not 1 <= self.confirm_hits <= self.confirm_window <= 63:
            raise ConfigError(
                f"M-of-N is {self.confirm_hits} of {self.confirm_window}; it needs 1 <= hits <= window <= 63"
            )
        if self.coast_s is None and self.coast_scans is None:
            raise ConfigError("tracks would never be deleted: give coast_s or coast_scans")
        if self.coast_scans is not None and not 1 <= self.coast_scans <= 62:
            raise ConfigError(f"coast_scans is {self.coast_scans}; it must lie in 1..62")

    def confirmed(self, register: Register, t: float, xy: Floats, size: Floats) -> Mask:
        """(T,) tentative rows that now deserve belief. xy (T, d) positions, size (T,) of the objects."""
        enough = self._hits(register) >= self.confirm_hits
        old = t - register.born_s >= self.confirm_s * (1 - 1e-9)
        travelled = np.linalg.norm(xy - register.start, axis=1) >= self.confirm_travel * size
        return (register.status == TENTATIVE) & enough & old & travelled

    def hopeless(self, register: Register) -> Mask:
        """(T,) tentative rows with more misses in their window than M-of-N allows."""
        scans = np.minimum(_bit_length(register.history), self.confirm_window)
        misses = scans - self._hits(register)
        return (register.status == TENTATIVE) & (misses > self.confirm_window - self.confirm_hits)

    def lost(self, register: Register, t: float) -> Mask:
        """(T,) rows without evidence for too long; by misses only those that are confirmed."""
        gone = np.zeros(len(register), bool)
        if self.coast_scans is not None:
            unseen = register.history & ((1 << self.coast_scans) - 1) == 0
            gone |= (register.status != TENTATIVE) & unseen
        if self.coast_s is not None:
            patience = np.where(register.status == MERGED, self.hidden_s, self.coast_s)
            gone |= t - register.updated_s > np.maximum(patience, self.coast_s)
        return gone

    def _hits(self, register: Register) -> np.ndarray:
        return np.bitwise_count(register.history & ((1 << self.confirm_window) - 1)).astype(np.int64)


def _bit_length(history: np.ndarray) -> np.ndarray:
    """Scans since birth: the birth itself is the highest bit set."""
    return np.frexp(history.astype(float))[1].astype(np.int64)
