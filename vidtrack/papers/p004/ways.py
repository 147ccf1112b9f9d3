"""The tracking methods that figures 5 and 6 compare on the same blobs."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

from vidtrack.associate.gate import Distance
from vidtrack.config.settings import TrackerSettings
from vidtrack.papers.p004.clips import Watched, follow, unshared
from vidtrack.tracks import Tracks

WORDS: dict[Distance, str] = {"euclidean": "minimum distance", "mahalanobis": "confidence region"}


@dataclass(frozen=True, slots=True)
class Way:
    """Association rule, distance, and treatment of a blob of several vehicles.

    shared  "one measurement": of one vehicle, as in the paper; "no measurement": as in the Monte Carlo experiment; both
            with that experiment's gate and without early deletion. "recognised": the default settings
    """

    method: Literal["nn", "gnn"]
    distance: Distance
    shared: Literal["one measurement", "no measurement", "recognised"]

    def settings(self) -> TrackerSettings:
        """Settings of the tracker."""
        if self.shared == "recognised":
            return TrackerSettings(method=self.method, distance=self.distance)
        return TrackerSettings(
            method=self.method, distance=self.distance, merged_blobs=False, gate_probability=0.9999, coast_s=3.0
        )

    def row(self) -> dict[str, object]:
        """The first columns of its row in a table."""
        return {"method": self.method, "distance": self.distance, "shared_blob": self.shared}

    def paper(self, near: str, region: str) -> str:
        """The paper's statement on this method, by minimum distance or by confidence region."""
        return "" if self.shared != "one measurement" else region if self.distance == "mahalanobis" else near

    def __str__(self) -> str:
        return f"{WORDS[self.distance]}, {self.method}"


NN_NEAR, NN_REGION = Way("nn", "euclidean", "one measurement"), Way("nn", "mahalanobis", "one measurement")
NEAR, REGION = Way("gnn", "euclidean", "one measurement"), Way("gnn", "mahalanobis", "one measurement")
NN_NEAR_UNSHARED, NN_REGION_UNSHARED = (replace(way, shared="no measurement") for way in (NN_NEAR, NN_REGION))
NEAR_UNSHARED, REGION_UNSHARED = (replace(way, shared="no measurement") for way in (NEAR, REGION))
DEFAULT = Way("gnn", "mahalanobis", "recognised")
WAYS = (
    NN_NEAR, NN_REGION, NEAR, REGION,
    NN_NEAR_UNSHARED, NN_REGION_UNSHARED, NEAR_UNSHARED, REGION_UNSHARED,
    DEFAULT,
)  # fmt: skip


def follow_all(watched: Watched) -> dict[Way, list[Tracks]]:
    """The clip tracked by every method."""
    apart = unshared(watched)
    return {way: follow(watched, way.settings(), apart if way.shared == "no measurement" else None) for way in WAYS}
