"""Opens any source of a run, for some seconds."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from time import monotonic

from vidtrack.config.inputs import Input
from vidtrack.config.settings import Settings
from vidtrack.recording.source import Recording, is_recording
from vidtrack.run.files import kind_of_file
from vidtrack.video.frame import Frame
from vidtrack.video.live.address import parse_address
from vidtrack.video.live.connection import connection_to
from vidtrack.video.live.source import LiveSource
from vidtrack.video.source import Source, open_source


def is_live(source: str) -> bool:
    """Whether the source is a camera or a stream, not a file."""
    return "://" in source or source.isdecimal() or Path(source).is_char_device()


def kind_of(source: str) -> Input:
    """The kind of the source."""
    return Input.CAMERA if is_live(source) else kind_of_file(source)


def open_pictures(source: str, settings: Settings) -> Source | LiveSource | Recording:
    """A source of frames. Raises SourceError if it cannot be opened."""
    if is_live(source):
        address = parse_address(source, settings.live.timeout_s)
        return LiveSource(address, settings.live, connect=connection_to(address, settings))
    if is_recording(source):
        return Recording(source)
    return open_source(source, settings.source)


def looked_at(
    frames: Source | LiveSource | Recording, seconds: float, patience_s: float, quiet_s: float
) -> Iterator[Frame]:
    """Yields the frames of `seconds` of the source's time.

    Ends early after `patience_s` of the clock, or when a live source yields no frame for `quiet_s`.
    """
    began_s: float | None = None
    heard_s = monotonic()
    until_s = heard_s + patience_s
    for frame in frames:
        if frame is not None:
            if began_s is None:
                began_s = frame.time_s
            if frame.time_s - began_s >= seconds:
                return
            yield frame
            heard_s = monotonic()
        if monotonic() > min(until_s, heard_s + quiet_s):
            return
