"""`seqinfo.ini`, the description of a MOTChallenge sequence, with its frame rate."""

from __future__ import annotations

import configparser
from dataclasses import dataclass
from pathlib import Path

from vidtrack.config.settings import SourceSettings
from vidtrack.errors import FormatError
from vidtrack.video.clock import FALLBACK_FPS
from vidtrack.video.stats import SourceStats


@dataclass(frozen=True, slots=True)
class SequenceInfo:
    """The used fields of seqinfo.ini; None if absent."""

    name: str | None = None
    fps: float | None = None
    length: int | None = None
    width: int | None = None
    height: int | None = None


def read_sequence_info(folder: Path) -> SequenceInfo:
    """seqinfo.ini in `folder` or the one above; all None without it.

    Raises FormatError if a value is not a positive number.
    """
    for path in (folder / "seqinfo.ini", folder.resolve().parent / "seqinfo.ini"):
        if path.is_file():
            return _read(path)
    return SequenceInfo()


def untimed_rate(info: SequenceInfo, settings: SourceSettings, stats: SourceStats) -> float:
    """Frames per second of an input without timestamps: the user's, the sequence's, else assumed with a warning."""
    if settings.fps is not None:
        return settings.fps
    if info.fps is not None:
        return info.fps
    stats.fps_assumed = True
    stats.warn(f"the input carries no time; {FALLBACK_FPS:g} frames/s assumed, state the true rate with --fps")
    return FALLBACK_FPS


def _read(path: Path) -> SequenceInfo:
    parser = configparser.ConfigParser(interpolation=None)
    try:
        parser.read_string(path.read_text(encoding="utf-8-sig"))
    except (configparser.Error, UnicodeDecodeError) as error:
        raise FormatError(f"{path} is not an INI file: {str(error).splitlines()[0]}") from None
    section = parser["Sequence"] if "Sequence" in parser else parser[configparser.DEFAULTSECT]

    def number(key: str) -> float | None:
        text = section.get(key)
        if text is None:
            return None
        try:
            value = float(text)
        except ValueError:
            value = 0.0
        if not 0 < value < float("inf"):
            raise FormatError(f"{path}: {key} = {text!r} is not a positive number")
        return value

    def count(key: str) -> int | None:
        value = number(key)
        return None if value is None else round(value)

    return SequenceInfo(
        name=section.get("name"),
        fps=number("frameRate"),
        length=count("seqLength"),
        width=count("imWidth"),
        height=count("imHeight"),
    )
