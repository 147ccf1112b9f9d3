"""The time of day at a site, in words."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import UTC, datetime, timedelta, timezone, tzinfo


@dataclass(frozen=True, slots=True)
class Clock:
    """The site's time in words. `zero`: when its time 0 was, in the site's zone; None: not known."""

    zero: datetime | None

    @classmethod
    def of(cls, utc: datetime | None, start: datetime | None) -> Clock:
        """Of time 0, in the zone of the site's start; without one, UTC."""
        zone: tzinfo = UTC if start is None else timezone(start.utcoffset() or timedelta())
        return cls(None if utc is None else utc.astimezone(zone))

    def label(self, t: float) -> str:
        """Time of day of t [s]; without a known time hours and minutes after the first picture."""
        if self.zero is not None:
            time = self.zero + timedelta(seconds=round(t))
            return time.strftime("%H:%M:%S" if time.second else "%H:%M")
        minutes, seconds = divmod(round(t), 60)
        return f"{minutes // 60}:{minutes % 60:02d}" + (f":{seconds:02d}" if seconds else "")

    def moment(self, t: float) -> str:
        """Time of day of t [s] to a tenth of a second; without a known time since the first picture."""
        if self.zero is not None:
            time = self.zero + timedelta(seconds=round(t, 1))
            return f"{time:%H:%M:%S}.{time.microsecond // 100_000}"
        hours, seconds = divmod(round(10 * t), 36000)
        return f"{hours}:{seconds // 600:02d}:{seconds % 600 / 10:04.1f}"

    def stamp(self, t: float) -> str:
        """Date and time of t [s], where they are known; else as `label`."""
        return f"{self.date(t) or ''} {self.label(t)}".strip()

    def date(self, t: float) -> str | None:
        """Date of t [s]."""
        return None if self.zero is None else (self.zero + timedelta(seconds=round(t))).date().isoformat()

    @property
    def zone(self) -> str:
        """What times are told in."""
        return "hours after the first picture" if self.zero is None else str(self.zero.tzinfo)
