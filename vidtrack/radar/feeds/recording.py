"""Feeds in files: what is in one is told from its content, and read at once."""

from __future__ import annotations

import logging
from collections import Counter, deque
from collections.abc import Collection
from dataclasses import replace
from itertools import islice
from pathlib import Path

import numpy as np

from vidtrack.config.radar import RadarSettings
from vidtrack.errors import ConfigError, PlotFormatError, SourceError
from vidtrack.radar.feeds import asterix, nmea
from vidtrack.radar.feeds.messages import Kind, Losses, Message, Messages
from vidtrack.radar.feeds.pace import Pace, is_unknown, paced
from vidtrack.radar.feeds.packets import explain_lack, is_capture, payloads
from vidtrack.radar.feeds.plots import (
    Choice,
    Code,
    FirstCopies,
    choose,
    plots_of,
    stray_senders,
    warn_of_assumed_errors,
    warn_of_others,
)
from vidtrack.radar.plane import Plane
from vidtrack.radar.plots import Plots
from vidtrack.radar.rhythm import closed_up

_log = logging.getLogger(__name__)
_LOOKED_AT = 1 << 20
"""Octets of a file from which its format is told."""
_LOOKED_AT_AGAIN = 1 << 16
"""Octets of a payload from which a decoder learns the time of day, and in which the first block is looked for."""
_PARQUET = b"PAR1"
_PAYLOADS = 50
"""Payloads of a capture with a known format, from which it is told: other things may be in it."""

Decoder = asterix.Decoder | nmea.Decoder


def is_feed(path: str | Path) -> bool:
    """Whether the file is a capture or another recording, by its content. False if it cannot be opened."""
    try:
        with Path(path).open("rb") as file:
            beginning = file.read(_LOOKED_AT)
    except OSError:
        return False
    return is_capture(beginning) or _kind(beginning) is not None or _before_blocks(beginning) > 0


def decoder_of(payload: bytes) -> type[Decoder] | None:
    """The decoder of a payload; None for one of another format."""
    if nmea.looks_like(payload):
        return nmea.Decoder
    return asterix.Decoder if b"\0" in payload and asterix.looks_like(payload) else None


def _kind(content: bytes) -> type[Decoder] | None:
    """The decoder for most of the first payloads that have one; one payload among others may have it by chance."""
    count = 0
    found: Counter[type[Decoder]] = Counter()
    for payload in payloads(content, Losses()):
        count += 1
        if kind := decoder_of(payload):
            found[kind] += 1
        if found.total() == _PAYLOADS:
            break
    return found.most_common(1)[0][0] if found and (found.total() > 1 or count == 1) else None


def _before_blocks(beginning: bytes) -> int:
    """Octets before the first blocks of ASTERIX in a file that begins with something else; 0: there are none."""
    if b"\0" not in beginning or beginning.startswith(_PARQUET):
        return 0
    try:
        return asterix.first_block(beginning, _LOOKED_AT_AGAIN) or 0
    except ConfigError:  # without its library no block is known to be one
        return 0


def read_messages(path: str | Path, losses: Losses) -> Messages:
    """All messages of a recording, in order of arrival; what is damaged is left out and counted.

    Raises SourceError if it cannot be opened, PlotFormatError if it is of no known format or empty, ConfigError if the
    library that decodes it is not installed.
    """
    try:
        content = Path(path).read_bytes()
    except OSError as error:
        raise SourceError(f"cannot open {path}: {error.strerror}") from None
    captured = is_capture(content)
    kind = _kind(content if captured else content[:_LOOKED_AT])
    if kind is None and captured:
        raise PlotFormatError(f"{path}: {explain_lack(content)}")
    if kind is None and (trash := _before_blocks(content[:_LOOKED_AT])):
        _log.warning("%s: the first block of ASTERIX is at octet %d; what is before it is left out", path, trash)
        losses.damaged += 1
        kind, content = asterix.Decoder, content[trash:]
    if kind is None:
        raise PlotFormatError(f"{path} is neither a recording of ASTERIX (raw, pcap, FINAL) nor of NMEA; give one")
    decoder = _informed(kind, content)
    decoder.losses = losses
    found: list[Message] = []
    for payload in payloads(content, losses):
        if captured and decoder_of(payload) is not kind:  # other traffic, or damage at its begin
            losses.damaged += 1
        else:
            found += decoder.messages(payload)
    if not found:
        raise PlotFormatError(f"{path} holds no message of a radar; {losses.damaged} damaged ones")
    return Messages.of(found)


def senders(path: str | Path, known: Collection[Code] = ()) -> list[Code]:
    """The code of each radar whose plots are in a recording of ASTERIX, of a known one however few they are.

    Raises the errors of `read_messages`.
    """
    messages = read_messages(path, Losses())
    plots = messages.only((messages.kind == Kind.POLAR) & (messages.category > 0))
    sending = np.setdiff1d(plots.source, stray_senders(messages, known))
    return [(source >> 8, source & 255) for source in sending.tolist()]


def _informed(kind: type[Decoder], content: bytes) -> Decoder:
    """A decoder that has read the beginning: some messages need a time of day that others say later."""
    decoder = kind(Losses())
    own = (payload for payload in payloads(content, Losses()) if decoder_of(payload[:_LOOKED_AT]) is kind)
    for payload in islice(own, _PAYLOADS):
        deque(decoder.messages(payload[:_LOOKED_AT_AGAIN]), maxlen=0)
    return decoder


def read_recording(path: str | Path, settings: RadarSettings, known: Collection[Code] = ()) -> Plots:
    """The plots of a recording; `known` are the codes of all its radars that are not those of damaged records.

    Scans are the turns of the antenna, or periods (see `pace_of`); `time_s` is seconds since midnight of the first day.
    A line in the log says what was left out. Raises the errors of `read_messages`, and PlotFormatError if no plots are
    in it, or those of several radars.
    """
    losses, name = Losses(), str(path)
    messages = read_messages(path, losses)
    choice = choose(messages, settings, name, known)
    losses.damaged += choice.damaged
    warn_of_others(choice, messages, settings, name)
    warn_of_assumed_errors(choice, settings, name)
    found = paced(FirstCopies(losses).of(choice.of(messages)), settings.scan_s, losses)
    if found is None:
        raise PlotFormatError(f"{name}: the plots have no time, and nothing else tells it")
    messages, pace = found
    warn_of_unknown_turns(pace, messages, settings, name)
    plane = plane_of(choice, messages, settings, name)
    scan = closed_up(np.floor(pace.progress(messages)).astype(np.int64), messages.time_s)
    plots = plots_of(messages.only(~messages.marks), scan[~messages.marks], settings, plane, losses)
    if str(losses):
        _log.warning("%s: left out: %s", name, losses)
    return replace(plots, scan=plots.scan - plots.scan[0], losses=losses.as_dict(), plane=plane)


def warn_of_unknown_turns(pace: Pace, messages: Messages, settings: RadarSettings, name: str) -> None:
    """A warning, if neither the settings nor the messages say what a scan is of plots that come one by one."""
    if settings.scan_s is None and is_unknown(pace, messages):
        _log.warning(
            "%s: neither marks nor azimuths tell how long the antenna takes for a turn; scans of %.3g s are assumed: "
            "set radar.scan_s", name, pace.period_s,
        )  # fmt: skip


def plane_of(choice: Choice, messages: Messages, settings: RadarSettings, name: str) -> Plane | None:
    """The plane of positions in degrees: that of the radar's position, else of the first message."""
    if settings.geodetic is not None:
        return Plane(*settings.geodetic)
    if choice.kind != Kind.GEODETIC:
        return None
    first = messages.only(~messages.marks)
    plane = Plane(round(float(first.u[0]), 6), round(float(first.v[0]), 6))
    _log.warning("%s: x = y = 0 is the first position, %.6f,%.6f; --radar-position sets another",
                 name, plane.latitude, plane.longitude)  # fmt: skip
    return plane
