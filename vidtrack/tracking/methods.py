"""All association methods by the names that users give them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from vidtrack.associate import methods
from vidtrack.associate.gate import PROBABILITY, Gate, LikelihoodGate
from vidtrack.associate.hard import Associator
from vidtrack.associate.jpda import JPDA
from vidtrack.config.settings import TrackerSettings
from vidtrack.tracking.deferred.forest import ForestRule
from vidtrack.tracking.deferred.mht import MHT
from vidtrack.tracking.deferred.splitting import Split
from vidtrack.tracking.lifecycle import Life, LifeCycle
from vidtrack.tracking.log_ratio import LogRatio

METHODS: dict[str, Callable[[], Associator | ForestRule]] = {**methods.METHODS, "split": Split, "mht": MHT}
"""Those that decide in one scan, and those that wait."""


def rule(settings: TrackerSettings, *, unresolved: bool = False) -> Associator | ForestRule:
    """The association method of these settings.

    unresolved  targets may share measurements; when they part, both of a pair's orders are equally probable, and
                jpda must be JPDA*, which takes one of them: with the mean of both the tracks would coalesce
    """
    if settings.method == "jpda" and unresolved:
        return JPDA(star=True)
    if settings.method == "mht":
        return MHT(n_scan=settings.n_scan)
    if settings.method == "split":
        return Split(n_scan=settings.n_scan)
    return methods.METHODS[settings.method]()


def gate(settings: TrackerSettings, radius: float, *, adaptive: bool = False, loss: float = 1.0) -> Gate:
    """The gate of these settings; radius [px or m] of the euclidean distance.

    adaptive  without a probability given, the gate follows P_D and clutter density; `loss` as in LikelihoodGate
    """
    if settings.gate_probability is None and adaptive and settings.distance == "mahalanobis":
        return LikelihoodGate(detection_probability=None, new_density=None, loss=loss)
    probability = PROBABILITY if settings.gate_probability is None else settings.gate_probability
    return Gate(probability, settings.distance, radius)


def life(
    kind: str,
    settings: TrackerSettings,
    hits: int,
    window: int,
    *,
    idle_s: float | None = None,
    idle_travel: float = 0.0,
    **patience: Any,
) -> Life:
    """The rules of confirmation and deletion by their name: m-of-n as given, or llr, the score.

    idle_s, idle_travel  those of m-of-n, see LifeCycle
    patience  what both have in common: confirm_s, confirm_travel, coast_s, hidden_s, coast_scans
    """
    if kind == "llr":
        return LogRatio(settings.false_track, settings.missed_track, **patience)
    return LifeCycle(hits, window, idle_s=idle_s, idle_travel=idle_travel, **patience)
