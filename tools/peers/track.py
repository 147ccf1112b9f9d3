"""Run one peer's tracker over stored boxes; started by a benchmark in the peers' own environment.

    python track.py PEER DATA.npz RESULT.npz

DATA   box (N, 4) left, top, width, height of all frames, start (F + 1,) where each begins, fps
RESULT seconds (F,) of each step, and the rows frame, id, detection (N,): which track took which box

The objects that a peer wants as detections are made before the clock starts. A peer has its default
settings; where it has none, those in its class below.
"""

from __future__ import annotations

import datetime
import sys
from collections.abc import Callable
from time import perf_counter
from typing import Any, Protocol

import numpy as np

Assigned = list[tuple[int, int]]
MIN_IOU = 0.3


class Peer(Protocol):
    """A tracker behind one face."""

    def prepare(self, frame: int, box: np.ndarray) -> Any:
        """The boxes (M, 4) of a frame in the peer's own form."""

    def step(self, detections: Any) -> Any:
        """One frame: what is timed."""

    def assigned(self, frame: int, result: Any) -> Assigned:
        """(detection, track id) of this frame's established tracks, from what `step` returned."""


class Roboflow:
    """A tracker of roboflow `trackers`, its frame rate given."""

    def __init__(self, kind: str, fps: float) -> None:
        import trackers

        self.tracker = getattr(trackers, kind)(frame_rate=fps)

    def prepare(self, frame: int, box: np.ndarray) -> Any:
        import supervision

        corners = np.hstack([box[:, :2], box[:, :2] + box[:, 2:]])
        return supervision.Detections(xyxy=corners, confidence=np.ones(len(box)), data={"index": np.arange(len(box))})

    def step(self, detections: Any) -> Any:
        return self.tracker.update(detections)

    def assigned(self, frame: int, result: Any) -> Assigned:
        pairs = zip(result.data["index"], result.tracker_id, strict=True)
        return [(int(j), int(identity)) for j, identity in pairs if identity >= 0]


class Norfair:
    """norfair on boxes by IoU, or on their centres by distance; the threshold has no default."""

    def __init__(self, distance: str, threshold: float) -> None:
        import norfair

        self.detection = norfair.Detection
        self.tracker = norfair.Tracker(distance_function=distance, distance_threshold=threshold)
        self.centres = distance == "euclidean"

    def prepare(self, frame: int, box: np.ndarray) -> Any:
        corners = np.stack([box[:, :2], box[:, :2] + box[:, 2:]], axis=1)
        points = corners.mean(axis=1, keepdims=True) if self.centres else corners
        return [self.detection(p, data=(frame, j)) for j, p in enumerate(points)]

    def step(self, detections: Any) -> Any:
        return self.tracker.update(detections)

    def assigned(self, frame: int, result: Any) -> Assigned:
        last = [(track.last_detection.data, track.id) for track in result]
        return [(j, identity) for (seen, j), identity in last if seen == frame]


class Motpy:
    """motpy, which keeps to itself which detection a track took: its matching is listened to."""

    def __init__(self, fps: float) -> None:
        import motpy
        from motpy.tracker import IOUAndFeatureMatchingFunction

        class Listening(IOUAndFeatureMatchingFunction):
            matched: list[tuple[int, str]]

            def __call__(self, trackers: Any, detections: Any) -> Any:
                pairs = super().__call__(trackers, detections)
                self.matched = [(int(j), trackers[t].id) for t, j in pairs]
                return pairs

        self.detection = motpy.Detection
        self.matching = Listening()
        self.tracker = motpy.MultiObjectTracker(dt=1 / fps, matching_fn=self.matching)
        self.number: dict[str, int] = {}

    def prepare(self, frame: int, box: np.ndarray) -> Any:
        corners = np.hstack([box[:, :2], box[:, :2] + box[:, 2:]])
        return [self.detection(box=corner) for corner in corners]

    def step(self, detections: Any) -> Any:
        return self.tracker.step(detections)

    def assigned(self, frame: int, result: Any) -> Assigned:
        return [(j, self.number.setdefault(name, len(self.number))) for j, name in self.matching.matched]


class Similari:
    """similari's SORT by IoU."""

    def __init__(self) -> None:
        import similari

        self.box = similari.BoundingBox
        self.tracker = similari.Sort(method=similari.PositionalMetricType.iou(threshold=MIN_IOU))

    def prepare(self, frame: int, box: np.ndarray) -> Any:
        return [(self.box(*map(float, sides)).as_xyaah(), j) for j, sides in enumerate(box)]

    def step(self, detections: Any) -> Any:
        return self.tracker.predict(detections)

    def assigned(self, frame: int, result: Any) -> Assigned:
        return [(track.custom_object_id, track.id) for track in result]


class StoneSoup:
    """Stone Soup's multi-target tracker: Kalman filter, GNN by 2-D assignment, candidates from a k-d tree.

    Constant velocity and centres of boxes measured to 3 px; three neighbours within three sigma; three
    measurements make a track and a second without one ends it.
    """

    def __init__(self, fps: float) -> None:
        from stonesoup.dataassociator.tree import DetectionKDTreeGNN2D
        from stonesoup.deleter.time import UpdateTimeDeleter
        from stonesoup.hypothesiser.distance import DistanceHypothesiser
        from stonesoup.initiator.simple import MultiMeasurementInitiator
        from stonesoup.measures import Mahalanobis
        from stonesoup.models.measurement.linear import LinearGaussian
        from stonesoup.models.transition.linear import CombinedLinearGaussianTransitionModel, ConstantVelocity
        from stonesoup.predictor.kalman import KalmanPredictor
        from stonesoup.tracker.simple import MultiTargetTracker
        from stonesoup.types.detection import Detection
        from stonesoup.types.state import GaussianState
        from stonesoup.types.update import Update
        from stonesoup.updater.kalman import KalmanUpdater

        self.detection, self.update, self.fps = Detection, Update, fps
        self.origin = datetime.datetime(2000, 1, 1)
        self.model = LinearGaussian(4, (0, 2), np.diag([9.0, 9.0]))
        predictor = KalmanPredictor(CombinedLinearGaussianTransitionModel([ConstantVelocity(500.0)] * 2))
        updater = KalmanUpdater(self.model)
        associator = DetectionKDTreeGNN2D(
            DistanceHypothesiser(predictor, updater, Mahalanobis(), missed_distance=3),
            predictor,
            updater,
            number_of_neighbours=3,
        )
        deleter = UpdateTimeDeleter(datetime.timedelta(seconds=1))
        prior = GaussianState([0, 0, 0, 0], np.diag([9.0, 150.0**2, 9.0, 150.0**2]), timestamp=self.origin)
        initiator = MultiMeasurementInitiator(prior, deleter, associator, updater, self.model, min_points=3)
        self.queue: list[Any] = []
        self.tracker = MultiTargetTracker(initiator, deleter, self._queued(), associator, updater)
        self.steps = iter(self.tracker)
        self.number: dict[str, int] = {}

    def _queued(self) -> Any:
        while True:
            yield self.queue.pop()

    def prepare(self, frame: int, box: np.ndarray) -> Any:
        time = self.origin + datetime.timedelta(seconds=frame / self.fps)
        centre = box[:, :2] + box[:, 2:] / 2
        return time, {
            self.detection(z, timestamp=time, metadata={"index": j}, measurement_model=self.model)
            for j, z in enumerate(centre)
        }

    def step(self, detections: Any) -> Any:
        self.queue.append(detections)
        return next(self.steps)[1]

    def assigned(self, frame: int, result: Any) -> Assigned:
        last = ((track.states[-1], track.id) for track in result)
        return [
            (state.hypothesis.measurement.metadata["index"], self.number.setdefault(name, len(self.number)))
            for state, name in last
            if isinstance(state, self.update)
        ]


PEERS: dict[str, Callable[[float], Peer]] = {
    "sort": lambda fps: Roboflow("SORTTracker", fps),
    "bytetrack": lambda fps: Roboflow("ByteTrackTracker", fps),
    "ocsort": lambda fps: Roboflow("OCSORTTracker", fps),
    "motpy": lambda fps: Motpy(fps),
    "similari": lambda fps: Similari(),
    "stonesoup": lambda fps: StoneSoup(fps),
    "norfair-iou": lambda fps: Norfair("iou", 1 - MIN_IOU),
    "norfair-euclidean": lambda fps: Norfair("euclidean", 30.0),
}


def main(name: str, data: str, result: str) -> None:
    """Run the peer over all frames and store what it did."""
    stored = np.load(data)
    frames = np.split(stored["box"], stored["start"][1:-1])
    peer = PEERS[name](float(stored["fps"]))
    detections = [peer.prepare(frame, box) for frame, box in enumerate(frames)]
    seconds = np.empty(len(frames))
    rows: list[tuple[int, int, int]] = []
    for frame, prepared in enumerate(detections):
        begin = perf_counter()
        found = peer.step(prepared)
        seconds[frame] = perf_counter() - begin
        rows.extend((frame, identity, detection) for detection, identity in peer.assigned(frame, found))
    frame_of, identity_of, detection_of = np.array(rows, np.int64).reshape(-1, 3).T
    np.savez(result, seconds=seconds, frame=frame_of, id=identity_of, detection=detection_of)


if __name__ == "__main__":
    main(*sys.argv[1:])
