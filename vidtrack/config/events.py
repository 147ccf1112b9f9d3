"""Settings of the events that live runs send."""

from __future__ import annotations

from pathlib import Path

from pydantic import Field

from vidtrack.config.group import Group


class EventSettings(Group):
    """What is sent with --mqtt and --webhook."""

    queue_bytes: float = Field(10e6, ge=1e5)
    """bytes of events that wait for each receiver on the disk; beyond it the oldest are dropped"""
    timeout_s: float = Field(10.0, gt=0, le=300)
    """s; longest time in which a receiver confirms"""
    discovery: str | None = Field("homeassistant", pattern=r"^[^+#\x00]+$")
    """first part of the topics where Home Assistant looks for devices; None: it is not told"""
    ca_file: Path | None = None
    """certificates that receivers with TLS are checked by (PEM); None: those of the system"""
    pictures: bool = False
    """a picture of each crossing, zone entry and conflict is kept in the folder pictures"""
