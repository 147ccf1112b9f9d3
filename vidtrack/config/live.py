"""Settings of live runs."""

from __future__ import annotations

from zoneinfo import ZoneInfo, ZoneInfoNotFoundError

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
    """a camera that cannot be opened at the start is tried without limit; false: three times. Several cameras: true"""
    roll_s: float | None = Field(None, gt=0)
    """s; length of a sub-folder of results, aligned to the clock; None: one folder; 3600 with keep_* or output.site"""
    keep_s: float | None = Field(None, gt=0)
    """s; older tracks and recordings are deleted, and their counts stay; None: no limit"""
    keep_bytes: float | None = Field(None, ge=1e6)
    """bytes; limit of tracks and recordings together, beyond which the oldest are deleted; None: no limit"""
    keep_tracks_s: float | None = Field(None, gt=0)
    """s; older tracks are deleted; None: live.keep_s"""
    keep_tracks_bytes: float | None = Field(None, ge=1e6)
    """bytes; limit of tracks; None: only live.keep_bytes"""
    keep_recordings_s: float | None = Field(None, gt=0)
    """s; older recordings are deleted; None: live.keep_s"""
    keep_recordings_bytes: float | None = Field(None, ge=1e6)
    """bytes; limit of recordings; None: only live.keep_bytes"""
    keep_counts_s: float | None = Field(None, gt=0)
    """s; older counts are deleted; None: they stay for ever"""
    keep_pictures_s: float | None = Field(None, gt=0)
    """s; older pictures of events are deleted; None: no limit"""
    keep_pictures_bytes: float | None = Field(None, ge=1e6)
    """bytes; limit of pictures of events; None: no limit"""
    reserve_bytes: float | None = Field(None, ge=0)
    """bytes of a disk that recordings leave free, tracks a fifth of them; None: 5 % of the disk, at most 1 GB"""
    replace_state: bool = False
    """a state that cannot be used is set aside, and numbers go on far ahead; false: it ends the run with an error"""
    zone: str | None = None
    """time zone of days and of the clock on pictures, such as Europe/Berlin; None: that of this machine"""
    every_frame: bool = False
    """track every frame, and fall behind if the machine is too slow; false: track the newest and drop others"""
    ffmpeg: tuple[str, ...] = ()
    """NAME=VALUE options of FFmpeg, such as rtsp_transport=udp, video_size=1280x720 or input_format=mjpeg"""

    @field_validator("zone")
    @classmethod
    def _is_a_zone(cls, zone: str | None) -> str | None:
        try:
            return zone and ZoneInfo(zone).key
        except (ZoneInfoNotFoundError, ValueError, OSError):
            raise ValueError(f"{zone!r} is no time zone; write it as Europe/Berlin or UTC") from None

    @property
    def limited(self) -> bool:
        """Whether results are deleted, which must be in parts then; pictures of events are none."""
        keeps = {name for name in type(self).model_fields if name.startswith("keep_")}
        return any(getattr(self, name) is not None for name in keeps - {"keep_pictures_s", "keep_pictures_bytes"})

    @field_validator("ffmpeg")
    @classmethod
    def _name_and_value(cls, options: tuple[str, ...]) -> tuple[str, ...]:
        for option in options:
            if not option.partition("=")[1]:
                raise ValueError(f"{option!r} is not NAME=VALUE")
        return options
