"""All association methods by the names that users give them."""

from __future__ import annotations

from collections.abc import Callable

from vidtrack.associate import methods
from vidtrack.associate.hard import Associator
from vidtrack.tracking.forest import Deferred
from vidtrack.tracking.mht import MHT
from vidtrack.tracking.splitting import Split

METHODS: dict[str, Callable[[], Associator | Deferred]] = {**methods.METHODS, "split": Split, "mht": MHT}
"""Those that decide in one scan, and those that wait."""
