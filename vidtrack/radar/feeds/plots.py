"""Messages become plots: one sender, one category, one plane, each plot once."""

from __future__ import annotations

import logging
import math
from collections import Counter, deque
from collections.abc import Collection
from dataclasses import dataclass

import numpy as np

from vidtrack.arrays.types import Floats, Ints, Mask
from vidtrack.config.radar import RadarSettings
from vidtrack.errors import PlotFormatError
from vidtrack.radar.coordinates import wrap
from vidtrack.radar.feeds.clock import within_a_day
from vidtrack.radar.feeds.messages import NO_TARGET, Kind, Losses, Messages
from vidtrack.radar.plane import Plane
from vidtrack.radar.plots import Plots

_log = logging.getLogger(__name__)
_CATEGORIES = (48, 1, 62, 21, 0)
"""What is tracked, if a feed has several: plots, others' tracks, what ships and aircraft say themselves."""
_KINDS = (Kind.POLAR, Kind.GEODETIC, Kind.CARTESIAN)
_PLACES = {Kind.POLAR: "plots", Kind.GEODETIC: "positions", Kind.CARTESIAN: "positions"}
_NAMES = {48: "CAT 048", 1: "CAT 001", 62: "CAT 062", 21: "CAT 021", 0: "NMEA"}


_STRAYS, _STRAY_SHARE = 3, 0.01
"""A sender of at most so many messages, and of at most this share of all, is none: its code is damaged."""


Code = tuple[int, int]
"""SAC and SIC of a radar."""


@dataclass(frozen=True, slots=True)
class Choice:
    """What of a feed is tracked: the messages of one sender (SAC * 256 + SIC), category and kind, and its marks.

    damaged  number of plots of the category in the whole feed whose sender's code is damaged
    """

    source: int
    category: int
    kind: Kind
    damaged: int

    def holds(self, messages: Messages) -> Mask:
        """(N,) the chosen messages and the antenna's marks."""
        wanted = (messages.category == self.category) & (messages.kind == self.kind)
        return np.asarray((messages.source == self.source) & (wanted | messages.marks))

    def of(self, messages: Messages) -> Messages:
        """The messages that it holds."""
        return messages.only(self.holds(messages))


def wanted(messages: Messages, settings: RadarSettings) -> Messages:
    """The positions from the sender that the settings name, or from all."""
    positions = messages.only(~messages.marks)
    if settings.sac is not None:
        positions = positions.only(positions.source >> 8 == settings.sac)
    if settings.sic is not None:
        positions = positions.only(positions.source & 255 == settings.sic)
    return positions


def choose(messages: Messages, settings: RadarSettings, name: str, known: Collection[Code] = ()) -> Choice:
    """What is tracked of a feed; senders with a known code are radars, however few messages they sent.

    Raises PlotFormatError for a feed without positions, or with several radars of which none is chosen.
    """
    positions = wanted(messages, settings)
    if not len(positions):
        raise PlotFormatError(f"{name} holds {nothing_wanted(messages, settings)}")
    category = next(one for one in _CATEGORIES if (positions.category == one).any())
    chosen = positions.only(positions.category == category)
    strays = stray_senders(messages, known)
    stray = np.isin(chosen.source, strays)
    stray &= not stray.all()
    chosen = chosen.only(~stray)
    sources = Counter(chosen.source.tolist())
    if len(sources) > 1:
        listed = ", ".join(f"{_sender(one)} ({count} plots)" for one, count in sources.most_common(8))
        raise PlotFormatError(
            f"{name} holds the plots of {len(sources)} radars (SAC/SIC): {listed}; choose one with --set radar.sac=... "
            "--set radar.sic=..."
        )
    kind = next(one for one in _KINDS if (chosen.kind == one).any())
    source = chosen.source[0].item()
    damaged = ~messages.marks & (messages.category == category) & np.isin(messages.source, strays[strays != source])
    return Choice(source, category, kind, int(damaged.sum()))


def stray_senders(messages: Messages, known: Collection[Code] = ()) -> Ints:
    """(N,) senders of so few messages that a damaged code made them; those with a known code are none."""
    source, count = np.unique(messages.source, return_counts=True)
    few = source[(count <= _STRAYS) & (count <= _STRAY_SHARE * len(messages))]
    return np.setdiff1d(few, [sac << 8 | sic for sac, sic in known])


def nothing_wanted(messages: Messages, settings: RadarSettings) -> str:
    """What messages are without wanted plots, and what they hold instead, in words."""
    whose = "" if settings.sac is None and settings.sic is None else " of the radar with this sac and sic"
    marks = "marks of the antenna only" if len(messages) and messages.marks.all() else ""
    return f"no plots{whose}; it has {marks or _contents(messages)}"


def warn_of_others(choice: Choice, messages: Messages, settings: RadarSettings, name: str) -> None:
    """A warning says what of a feed is not tracked; of its sender only, if the settings name that."""
    others = messages.only(~choice.holds(messages))
    if settings.sac is not None and settings.sic is not None:
        others = others.only(others.source == choice.source)
    if not others.marks.all():
        _log.warning("%s: tracked are %s; not %s", name, _contents(choice.of(messages)), _contents(others))


def _contents(messages: Messages) -> str:
    positions = messages.only(~messages.marks)
    columns = (one.tolist() for one in (positions.category, positions.source, positions.kind))
    found = Counter(zip(*columns, strict=True)).most_common(8)
    said = (f"{count} {_PLACES[kind]} of {_named_sender(*sender)}" for (*sender, kind), count in found)
    return ", ".join(said) or "none"


def _named_sender(category: int, source: int) -> str:
    """A format, and the code of the radar that sent it; NMEA has none."""
    return _NAMES[category] if category == 0 else f"{_NAMES[category]} from {_sender(source)}"


def _sender(source: int) -> str:
    """SAC/SIC."""
    return f"{source >> 8}/{source & 255}"


def plots_of(messages: Messages, scan: Ints, settings: RadarSettings, plane: Plane | None, losses: Losses) -> Plots:
    """The plots of chosen positions (N,) in scans (N,), in order of scan and time.

    plane  of the coordinates; None: range and azimuth, or x and y, are as they come
    A target that names itself is in a scan once, with its last report.
    """
    order = np.lexsort((messages.time_s, scan))
    messages, scan = messages.only(order), scan[order]
    kept = _single(messages, scan)
    losses.duplicates += int((~_named(messages) & ~kept).sum())
    messages, scan = messages.only(kept), scan[kept]
    polar = bool(len(messages)) and messages.kind[0] == Kind.POLAR
    doppler = polar and bool(np.isfinite(messages.doppler_m_s).all())
    z = _positions(messages, plane)
    sigmas = [settings.sigma_position_m] * 2
    if polar:
        sigmas = [settings.sigma_range_m, np.radians(settings.sigma_azimuth_deg)]
    if doppler:
        z, sigmas = np.column_stack([z, messages.doppler_m_s]), [*sigmas, settings.sigma_doppler_m_s]
    sigma = np.broadcast_to(np.array(sigmas, dtype=float), z.shape)
    return Plots(scan, messages.time_s, z, sigma, polar, 2, doppler, None, bad_rows=losses.damaged)


class FirstCopies:
    """Leaves out the plots and marks that came before to the digit, as from a second feed of one radar that is late.

    A late copy must not look like a clock that was set back, so this comes before the times are read.

    remembered_s  s; by how much the time of what is remembered may differ from that of the newest
    most          number of plots and marks that are remembered
    """

    def __init__(self, losses: Losses, remembered_s: float = math.inf, most: float = math.inf) -> None:
        self._losses, self._remembered_s, self._most = losses, remembered_s, most
        self._seen: set[bytes] = set()
        self._order: deque[tuple[float, bytes]] = deque()
        self._time_s = math.nan  # of the last message

    def of(self, messages: Messages) -> Messages:
        """The messages without those that came before, among them or in an earlier call, in order of arrival."""
        rows = np.flatnonzero(~_named(messages) & np.isfinite(messages.time_s))
        some = messages.only(rows)
        columns = [some.kind, some.source, some.category, some.time_s, some.u, some.v]
        digits = np.nan_to_num(np.column_stack(columns)) + 0.0  # no -0, whose octets are others
        came = zip(some.time_s.tolist(), digits, strict=True)
        again = np.array([self._came_before(time_s, row.tobytes()) for time_s, row in came], bool)
        self._losses.duplicates += int((again & ~some.marks).sum())
        kept = np.ones(len(messages), bool)
        kept[rows[again]] = False
        return messages.only(kept)

    def _came_before(self, time_s: float, digits: bytes) -> bool:
        """Whether a message came before; remembers it, and forgets those of other times, by two messages that agree."""
        if digits in self._seen:
            return True
        agreed = not self._is_far(time_s, self._time_s)
        self._time_s = time_s
        self._seen.add(digits)
        self._order.append((time_s, digits))
        while len(self._order) > self._most or (agreed and self._is_far(time_s, self._order[0][0])):
            self._seen.remove(self._order.popleft()[1])
        return False

    def _is_far(self, time_s: float, other_s: float) -> bool:
        return math.isfinite(other_s) and abs(within_a_day(time_s - other_s)) > self._remembered_s


def _named(messages: Messages) -> Mask:
    return np.asarray(messages.target != NO_TARGET)


def _single(messages: Messages, scan: Ints) -> Mask:
    """(N,) plots that are not the same as another of their scan, and the last report of each target in a scan."""
    named = _named(messages)
    same = np.where(named, 0.0, messages.time_s), np.where(named, 0.0, messages.u), np.where(named, 0.0, messages.v)
    keys = np.column_stack([scan, messages.target, *same])
    kept = np.zeros(len(keys), bool)
    last = len(keys) - 1 - np.unique(keys[::-1], axis=0, return_index=True)[1]
    kept[last] = True
    return kept


def _positions(messages: Messages, plane: Plane | None) -> Floats:
    """(N, 2) measurements of a scan: range [m] and azimuth [rad], or x and y [m]."""
    if len(messages) and messages.kind[0] == Kind.GEODETIC:
        assert plane is not None
        return plane.metres(messages.u, messages.v)
    v = wrap(messages.v) if len(messages) and messages.kind[0] == Kind.POLAR else messages.v
    return np.column_stack([messages.u, v])


def warn_of_assumed_errors(choice: Choice, settings: RadarSettings, name: str) -> None:
    """The formats do not say how large the errors are: a warning names the settings that are assumed."""
    polar = choice.kind == Kind.POLAR
    wanted = ("sigma_range_m", "sigma_azimuth_deg") if polar else ("sigma_position_m",)
    assumed = [f"radar.{one} = {getattr(settings, one):g}" for one in wanted if one not in settings.model_fields_set]
    if assumed:
        _log.warning("%s does not say how large its errors are: %s assumed", name, ", ".join(assumed))
