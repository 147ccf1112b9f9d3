"""Settings of live runs."""

from __future__ import annotations

from pydantic import Field, field_validator

from vidtrack.config.group import Group


class LiveSettings(Group):
    """Cameras and streams."""

    timeout_s: float = Field(5.0, gt=0, le=300)
    """s; opening or reading that takes longer is given up and begun anew"""
    backoff_s: float = Field(1.0, gt=0)
    """s; pause before the second attempt to connect, doubled with every further one"""
    backoff_longest_s: float = Field(30.0, gt=0)
    """s; longest pause between two attempts"""
    roll_s: float | None = Field(None, gt=0)
    """s; by the clock, after which results go on in a new sub-folder; None: never, or hourly if live.keep_* is set"""
    keep_s: float | None = Field(None, gt=0)
    """s; sub-folders that are older are deleted; None: none are"""
    keep_bytes: float | None = Field(None, ge=1e6)
    """bytes that results and recordings may take together; the oldest are deleted; None: no limit"""
    every_frame: bool = False
    """every frame is tracked, and a tracker that is too slow falls behind; false: the newest one, others are dropped"""
    ffmpeg: tuple[str, ...] = ()
    """NAME=VALUE options for opening, such as rtsp_transport=udp, video_size=1280x720 or input_format=mjpeg"""

    @field_validator("ffmpeg")
    @classmethod
    def _name_and_value(cls, options: tuple[str, ...]) -> tuple[str, ...]:
        for option in options:
            if not option.partition("=")[1]:
                raise ValueError(f"{option!r} is not NAME=VALUE")
        return options
