"""Settings of live runs."""

from __future__ import annotations

from pydantic import Field, field_validator

from vidtrack.config.group import Group


class LiveSettings(Group):
    """Cameras and streams."""

    timeout_s: float = Field(5.0, gt=0, le=300)
    """s; longest time to open or read, then the connection is opened again"""
    backoff_s: float = Field(1.0, gt=0)
    """s; pause before the second attempt to connect, doubled at each further attempt"""
    backoff_longest_s: float = Field(30.0, gt=0)
    """s; longest pause between two attempts"""
    retry_first: bool = False
    """a camera that cannot be opened at the start is tried again without limit, as a lost one is, unless it refuses the
    password; false: it is given up after three failures. With several cameras: true"""
    roll_s: float | None = Field(None, gt=0)
    """s; length of a sub-folder of results, aligned to the clock; None: one folder, or hourly if live.keep_* is set"""
    keep_s: float | None = Field(None, gt=0)
    """s; older sub-folders are deleted; None: no limit"""
    keep_bytes: float | None = Field(None, ge=1e6)
    """bytes; limit of results and recordings together, beyond which the oldest are deleted; None: no limit"""
    every_frame: bool = False
    """track every frame, and fall behind if the machine is too slow; false: track the newest and drop others"""
    ffmpeg: tuple[str, ...] = ()
    """NAME=VALUE options of FFmpeg, such as rtsp_transport=udp, video_size=1280x720 or input_format=mjpeg"""

    @field_validator("ffmpeg")
    @classmethod
    def _name_and_value(cls, options: tuple[str, ...]) -> tuple[str, ...]:
        for option in options:
            if not option.partition("=")[1]:
                raise ValueError(f"{option!r} is not NAME=VALUE")
        return options
