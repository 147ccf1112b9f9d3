"""How many conflicts there were of each kind, and the closest."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vidtrack.arrays.types import Ints
from vidtrack.traffic.report.findings import Findings

CLOSEST = 10
"""Most conflicts that a report lists one by one"""


@dataclass(frozen=True, slots=True)
class Kind:
    """Conflicts of one kind: their number, how many have each time, and the least of both [s]; inf: none."""

    kind: str
    count: int
    ttc: int
    pet: int
    least_ttc: float
    least_pet: float


@dataclass(frozen=True, slots=True)
class Close:
    """All kinds, those with most conflicts first, and the rows of the closest, by the smaller of both times."""

    kinds: tuple[Kind, ...]
    closest: Ints


def close_of(found: Findings) -> Close | None:
    """None without a table of conflicts."""
    if "conflicts" not in found.tables:
        return None
    words = np.array(found.words("conflicts", "kind"), str)
    ttc, pet = (found.numbers("conflicts", name) for name in ("ttc_s", "pet_s"))
    kinds = []
    for kind in np.unique(words):
        ours = words == kind
        least = (float(np.min(one[ours], initial=np.inf, where=np.isfinite(one[ours]))) for one in (ttc, pet))
        counts = (int(np.isfinite(one[ours]).sum()) for one in (ttc, pet))
        kinds.append(Kind(str(kind), int(ours.sum()), *counts, *least))
    closest = np.argsort(np.fmin(ttc, pet), kind="stable")[:CLOSEST]
    return Close(tuple(sorted(kinds, key=lambda one: -one.count)), closest)
