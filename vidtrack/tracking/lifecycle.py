"""The life cycle of a track: confirmation and deletion."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf
from typing import Protocol

import numpy as np
from scipy.special import bdtrc

from vidtrack.arrays.types import Floats, Ints, Mask
from vidtrack.compiled import inlined, kernel
from vidtrack.errors import ConfigError
from vidtrack.tracking.register import Register
from vidtrack.tracks import MERGED, TENTATIVE


class Life(Protocol):
    """Rules of confirmation and deletion for the rows of a register.

    birth            log-odds that a measurement which belongs to no track is a target's
    coast_s          s; no track that is alone outlives its last evidence by more; None: no limit
    confirms, ends   the reason that the events of a confirmation, and of a hopeless track's deletion, give
    """

    @property
    def birth(self) -> float: ...

    @property
    def coast_s(self) -> float | None: ...

    @property
    def confirms(self) -> str: ...

    @property
    def ends(self) -> str: ...

    def confirmed(self, register: Register, t: float, travel: Floats, size: Floats) -> Mask:
        """(T,) tentative rows to confirm now. travel (T,) from where they began, size (T,) of the objects."""

    def hopeless(self, register: Register) -> Mask:
        """(T,) rows to delete because their hits and misses speak against a target."""

    def lost(self, register: Register, t: float) -> Mask:
        """(T,) rows without evidence for too long."""

    def idle(self, register: Register, t: float) -> Mask:
        """(T,) rows that never travelled and no longer move."""


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
    idle_s          s; a track that has stood still for so long and never travelled `idle_travel` ends; None: it stays
    idle_travel     object sizes; for one that came in over the border of the picture half of it is enough
    """

    confirm_hits: int = 3
    confirm_window: int = 4
    confirm_s: float = 0.0
    confirm_travel: float = 0.0
    coast_s: float | None = None
    hidden_s: float = 2.0
    coast_scans: int | None = 5
    idle_s: float | None = None
    idle_travel: float = 1.2

    def __post_init__(self) -> None:
        if not 1 <= self.confirm_hits <= self.confirm_window <= 63:
            raise ConfigError(
                f"M-of-N is {self.confirm_hits} of {self.confirm_window}; it needs 1 <= hits <= window <= 63"
            )
        refuse_immortal(self.coast_s, self.coast_scans)

    @property
    def confirms(self) -> str:
        """M of N."""
        return f"{self.confirm_hits} hits of {self.confirm_window}"

    @property
    def ends(self) -> str:
        """Reason of the deletion of hopeless rows."""
        return "too many misses before confirmation"

    @property
    def birth(self) -> float:
        """As likely as not."""
        return 0.0

    def confirmed(self, register: Register, t: float, travel: Floats, size: Floats) -> Mask:
        """(T,) tentative rows with enough hits, age and travel (T,); size (T,) of the objects, infinite: never."""
        return _often(
            register.history, self.confirm_window, self.confirm_hits,
            register.status, register.born_s, travel, t, _full(self.confirm_s), least_travel(self.confirm_travel, size),
        )  # fmt: skip

    def hopeless(self, register: Register) -> Mask:
        """(T,) tentative rows with more misses in their window than M-of-N allows."""
        allowed = self.confirm_window - self.confirm_hits
        return _hopeless(register.history, register.status, self.confirm_window, allowed)

    def idle(self, register: Register, t: float) -> Mask:
        """(T,) rows that never travelled and no longer move: errors of the scene, not vehicles."""
        if self.idle_s is None:
            return np.zeros(len(register), bool)
        near, long = self.idle_travel, float(self.idle_s)
        return _idle(register.came_in, register.travelled, register.box, register.rest_s, t, near, long)

    def lost(self, register: Register, t: float) -> Mask:
        """(T,) rows without evidence for too long; by misses only those that are confirmed."""
        return unseen(register, t, self.coast_s, self.hidden_s, self.coast_scans, tentative=False)


def grown(register: Register, t: float, travel: Floats, age_s: float, least: Floats) -> Mask:
    """(T,) tentative rows that are old enough and whose travel (T,) is at least `least` (T,)."""
    return _grown(register.status, register.born_s, travel, t, _full(age_s), least)


def least_travel(sizes: float, size: Floats) -> Floats:
    """(T,) travel of so many sizes (T,); infinite where the size is, even if no travel is asked for."""
    return np.multiply(sizes, size, out=size.copy(), where=size < inf)


def _full(age_s: float) -> float:
    """An age that counts as this one, in spite of rounding."""
    return age_s * (1 - 1e-9)


def unseen(
    register: Register, t: float, coast_s: float | None, hidden_s: float, scans: int | None, *, tentative: bool
) -> Mask:
    """(T,) rows without evidence for coast_s, on shared blobs for hidden_s if that is longer, or without a hit in
    the last `scans` scans; None: no limit. The number of scans counts for tentative rows only if `tentative`.
    """
    alone = inf if coast_s is None else float(coast_s)
    return _unseen(
        register.status, register.updated_s, register.history, t, alone, max(float(hidden_s), alone),
        scans or 0, tentative,
    )  # fmt: skip


def refuse_immortal(coast_s: float | None, coast_scans: int | None) -> None:
    """Raise ConfigError where a track would never end for want of evidence."""
    if coast_s is None and coast_scans is None:
        raise ConfigError("tracks would never be deleted: give coast_s or coast_scans")
    if coast_s is not None and not coast_s >= 0:
        raise ConfigError(f"coast_s is {coast_s}; it must not be negative")
    if coast_scans is not None and not 1 <= coast_scans <= 62:
        raise ConfigError(f"coast_scans is {coast_scans}; it must lie in 1..62")


def confirmation_probability(p: float, hits: int, window: int, *, initiated: bool = True) -> float:
    """Probability that M of N scans show what each shows with probability p.

    initiated  the first of the N scans is the hit that started the track, as LifeCycle counts; else any N scans
    """
    return float(bdtrc(hits - 2, window - 1, p)) if initiated else float(bdtrc(hits - 1, window, p))


def scans_to_false_deletion(misses: int, detection: float) -> float:
    """Mean number of scans until `misses` in a row delete the track of a target that each scan shows with P_D."""
    q = 1 - detection
    return sum(q**-i for i in range(1, misses + 1)) if q > 0 else inf


@kernel
def _grown(status: np.ndarray, born_s: Floats, travel: Floats, now: float, old: float, least: Floats) -> Mask:
    grown = np.zeros(len(status), np.bool_)
    for t in range(len(status)):
        grown[t] = status[t] == TENTATIVE and now - born_s[t] >= old and travel[t] >= least[t]
    return grown


@kernel
def _unseen(
    status: np.ndarray, updated_s: Floats, history: Ints, now: float, alone: float, hidden: float,
    scans: int, tentative: bool,
) -> Mask:  # fmt: skip
    """scans: 0 for no limit."""
    unseen = np.zeros(len(status), np.bool_)
    for t in range(len(status)):
        missed = scans > 0 and history[t] & ((1 << scans) - 1) == 0
        counts = tentative or status[t] != TENTATIVE
        unseen[t] = now - updated_s[t] > (hidden if status[t] == MERGED else alone) or (missed and counts)
    return unseen


@kernel
def _idle(entered: Mask, travelled: Floats, box: Floats, rest_s: Floats, now: float, near: float, long: float) -> Mask:
    """(T,) rows that rest for `long` seconds and travelled less than `near` of their sizes, entered ones half of it."""
    idle = np.zeros(len(rest_s), np.bool_)
    for t in range(len(rest_s)):
        least = 0.5 * near if entered[t] else near
        stayed = travelled[t] < least * max(box[t, 2], box[t, 3])
        idle[t] = stayed and now - rest_s[t] > long
    return idle


@kernel
def _often(
    history: Ints, window: int, hits: int,
    status: np.ndarray, born_s: Floats, travel: Floats, now: float, old: float, least: Floats,
) -> Mask:  # fmt: skip
    """(T,) grown rows with so many hits within the window."""
    often = _grown(status, born_s, travel, now, old, least)
    for t in range(len(history)):
        often[t] = often[t] and _counts(history[t], window)[0] >= hits
    return often


@kernel
def _hopeless(history: Ints, status: np.ndarray, window: int, allowed: int) -> Mask:
    """(T,) tentative rows with more misses within the window than are allowed."""
    hopeless = np.zeros(len(history), np.bool_)
    for t in range(len(history)):
        hopeless[t] = status[t] == TENTATIVE and _counts(history[t], window)[1] > allowed
    return hopeless


@inlined
def _counts(history: int, window: int) -> tuple[int, int]:
    """Hits and misses of a row in its last `window` scans; its birth is the highest bit of its history."""
    hits, misses = 0, 0
    for _ in range(window):
        if history == 0:
            break
        hits += history & 1
        misses += 1 - (history & 1)
        history >>= 1
    return hits, misses
