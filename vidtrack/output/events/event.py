"""An event: something that happened before a camera, or to it, as other programs are told of it."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import UTC, datetime
from enum import StrEnum
from math import isnan
from typing import Any

PICTURES = "pictures"
"""Folder of the pictures of events, below that of their camera"""

_ID_LENGTH = 24
_DECIMALS = 3


class Kind(StrEnum):
    """What happened."""

    CROSSING = "crossing"
    ENTRY = "entry"
    CONFLICT = "conflict"
    PROBLEM = "problem"


@dataclass(frozen=True, slots=True)
class Event:
    """One event.

    camera   its name
    unix_s   Unix time [s]
    content  plain data; numbers that are NaN are not known and become null
    """

    kind: Kind
    camera: str
    unix_s: float
    content: Mapping[str, Any] = field(default_factory=dict)

    @property
    def utc(self) -> str:
        """The time in ISO 8601, in milliseconds."""
        return datetime.fromtimestamp(self.unix_s, UTC).isoformat(timespec="milliseconds").replace("+00:00", "Z")

    @property
    def id(self) -> str:
        """24 hexadecimal digits made from all the rest: the same event has the same id, however often it is sent."""
        whole = json.dumps([self.kind, self.camera, self.utc, _plain(self.content)], sort_keys=True)
        return hashlib.sha256(whole.encode()).hexdigest()[:_ID_LENGTH]

    def as_line(self, picture: str | None = None) -> str:
        """One line of JSON, which ends with a line break; `picture` is the path of its picture."""
        told = {"id": self.id, "event_type": str(self.kind), "camera": self.camera, "utc": self.utc}
        shown = {} if picture is None else {"picture": picture}
        return json.dumps(told | _plain(self.content) | shown, ensure_ascii=False, allow_nan=False) + "\n"


def _plain(content: Mapping[str, Any]) -> dict[str, Any]:
    return {name: _rounded(value) for name, value in content.items()}


def _rounded(value: Any) -> Any:
    if not isinstance(value, float):
        return value
    return None if isnan(value) else round(value, _DECIMALS)
