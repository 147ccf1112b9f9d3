"""The life cycle by track score: Wald's sequential test of target against clutter (Sittler 1964; Blackman 1986)."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, log

import numpy as np

from vidtrack.arrays.types import Floats, Mask
from vidtrack.errors import ConfigError
from vidtrack.tracking.lifecycle import grown, least_travel, refuse_immortal, unseen
from vidtrack.tracking.register import Register

LEAST = 1e-8
"""Smallest error probability: its thresholds are within the limits of scores."""


@dataclass(frozen=True, slots=True)
class LogRatio:
    """Confirmation and deletion by the log-likelihood ratio of target against clutter, over all scans.

    The score begins with ln(new_share). A hit adds ln(P_D N(v; 0, S) / clutter density), a miss ln(1 - P_D P_G).
    At ln((1 - missed_track) / false_track) the track is confirmed; ln((1 - false_track) / missed_track) below its
    first score it is deleted, and once it is confirmed as far below its highest.

    false_track   probability that a track of clutter is confirmed
    missed_track  probability that a target's track is deleted
    new_share     density of the measurements that new targets begin with, per density of false ones
    confirm_s, confirm_travel, coast_s, hidden_s, coast_scans   as for LifeCycle; the last three end tracks that
                  misses say nothing of, because nothing is expected to be seen of them
    """

    false_track: float = 1e-3
    missed_track: float = 2e-4
    new_share: float = 0.1
    confirm_s: float = 0.0
    confirm_travel: float = 0.0
    coast_s: float | None = None
    hidden_s: float = 2.0
    coast_scans: int | None = 20

    def __post_init__(self) -> None:
        for name in ("false_track", "missed_track"):
            if not LEAST <= getattr(self, name) < 0.5:
                raise ConfigError(f"{name} is {getattr(self, name)}; it must be at least {LEAST:g} and below 0.5")
        if not 0 < self.new_share < inf:
            raise ConfigError(f"share of new targets is {self.new_share}; it must be a finite number above 0")
        refuse_immortal(self.coast_s, self.coast_scans)

    @property
    def highest(self) -> float:
        """Score that confirms."""
        return log((1 - self.missed_track) / self.false_track)

    @property
    def drop(self) -> float:
        """Loss of score that deletes."""
        return log((1 - self.false_track) / self.missed_track)

    @property
    def confirms(self) -> str:
        """The score that was reached."""
        return f"score of {self.highest:.2f} reached"

    @property
    def ends(self) -> str:
        """Reason of the deletion of hopeless rows."""
        return f"score fell by {self.drop:.2f}"

    @property
    def birth(self) -> float:
        """ln of the density of new targets over that of clutter."""
        return log(self.new_share)

    def confirmed(self, register: Register, t: float, travel: Floats, size: Floats) -> Mask:
        """(T,) tentative rows with enough score, age and travel (T,); size (T,) of the objects."""
        return (register.score >= self.highest) & grown(
            register, t, travel, self.confirm_s, least_travel(self.confirm_travel, size)
        )

    def hopeless(self, register: Register) -> Mask:
        """(T,) rows whose score has fallen too far."""
        return register.score <= register.best - self.drop

    def idle(self, register: Register, t: float) -> Mask:
        """(T,) none: the score decides."""
        return np.zeros(len(register), bool)

    def lost(self, register: Register, t: float) -> Mask:
        """(T,) rows without evidence for too long."""
        return unseen(register, t, self.coast_s, self.hidden_s, self.coast_scans, tentative=True)
