"""What a radar says, whatever the format: antenna marks and positions, as arrays in order of arrival."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays.types import Floats, Ints

NO_TARGET = -1.0
NAN = float("nan")


class Kind(IntEnum):
    """Kinds of messages."""

    MARK = 0
    """the antenna points at v [rad]; u is the duration of a turn [s], NaN if not said"""
    POLAR = 1
    """u range [m], v azimuth [rad] from the radar"""
    CARTESIAN = 2
    """u east, v north [m] of the reference point"""
    GEODETIC = 3
    """u latitude, v longitude [degrees] in WGS84"""


class Message(NamedTuple):
    """One message.

    source      SAC and SIC of the sender as SAC * 256 + SIC; 0 if the format has none
    category    ASTERIX category; 0 for NMEA
    clock_s     s; time of day, which begins again at midnight; NaN if not said
    u, v        by the kind
    height_m, doppler_m_s   NaN if not said
    target      number that the sender has given to the target; NO_TARGET for a plot
    """

    kind: Kind
    source: int
    category: int
    clock_s: float
    u: float
    v: float
    height_m: float = NAN
    doppler_m_s: float = NAN
    target: float = NO_TARGET


@dataclass(frozen=True, slots=True)
class Messages:
    """N messages in order of arrival; the columns are as in Message, all (N,).

    time_s is the time since midnight of the first day, once `on_one_clock` has made it from clock_s.
    """

    kind: Ints
    source: Ints
    category: Ints
    time_s: Floats
    u: Floats
    v: Floats
    height_m: Floats
    doppler_m_s: Floats
    target: Floats

    @classmethod
    def of(cls, messages: list[Message]) -> Messages:
        """The columns of a list."""
        table = np.array(messages, dtype=float).reshape(len(messages), len(Message._fields))
        kind, source, category = table[:, :3].astype(np.int64).T
        return cls(kind, source, category, *table[:, 3:].T.copy())

    def __len__(self) -> int:
        return len(self.kind)

    def only(self, rows: NDArray) -> Messages:
        """The messages selected by a mask or by indices."""
        return Messages(*(getattr(self, name)[rows] for name in self.__slots__))

    def and_then(self, others: Messages) -> Messages:
        """These messages, then others."""
        return Messages(*(np.concatenate([getattr(self, n), getattr(others, n)]) for n in self.__slots__))

    @property
    def marks(self) -> NDArray[np.bool_]:
        """(N,) whether each is a mark of the antenna."""
        return np.asarray(self.kind == Kind.MARK)


@dataclass(slots=True)
class Losses:
    """What could not be used, counted.

    damaged     records or sentences that break the rules of their format
    strayed     messages whose clock disagrees with those around them
    duplicates  plots that came twice
    late        plots of scans that had been closed
    resets      times that a clock was set back
    truncated   1 if a capture ends within a packet
    """

    damaged: int = 0
    strayed: int = 0
    duplicates: int = 0
    late: int = 0
    resets: int = 0
    truncated: int = 0

    def __str__(self) -> str:
        said = [f"{count} {what}" for what, count in self.as_dict().items() if count]
        return ", ".join(said)

    def as_dict(self) -> dict[str, int]:
        """The counts by name."""
        return {name: getattr(self, name) for name in self.__slots__}
