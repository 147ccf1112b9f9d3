"""The register and the bank's states as tracks."""

from __future__ import annotations

from typing import Any

from vidtrack.arrays.types import Floats, Ints
from vidtrack.estimate.motion.model import Motion
from vidtrack.tracking.boxes import around
from vidtrack.tracking.register import Register
from vidtrack.tracks import Tracks


def snapshot(
    register: Register, model: Motion, t: float, x: Floats, P: Floats, taken: Ints, nis: Floats, **more: Any
) -> Tracks:
    """All rows at time t: states x (T, n), covariances P (T, n, n), measurements taken (T,), normalised innovations
    squared nis (T,); more of what `Tracks` holds.
    """
    xy = x.take(model.position, axis=1)
    return Tracks(
        t=t,
        id=register.id.copy(),
        status=register.status.copy(),
        x=x.copy(),
        P=P.copy(),
        box=around(x, register.box),
        group=register.merged.copy(),
        group_since_s=register.merged_since_s.copy(),
        age_s=t - register.born_s,
        travel=register.travel(xy),
        existence=register.existence,
        measurement=taken,
        nis=nis,
        position=model.position,
        velocity=model.velocity,
        run=register.run.copy(),
        exchange=register.exchange.copy(),
        entered=register.came_in,
        **more,
    )
