"""Run Stone Soup's GNN or JPDA over stored point measurements; started by a benchmark in the peers' environment.

    python urban.py gnn|jpda DATA.npz RESULT.npz

DATA    z (N, 2) of all scans, start (F + 1,) where each begins, dt, and the models: sigma, q, speed,
        detection_probability, clutter_density, gate_probability, confirm_hits, coast_scans
RESULT  frame, id (R,), xy (R, 2): where the tracks were
"""

from __future__ import annotations

import datetime
import sys
from collections.abc import Iterator
from typing import Any

import numpy as np
from scipy.stats import chi2
from stonesoup.dataassociator.neighbour import GNNWith2DAssignment
from stonesoup.dataassociator.probability import JPDAwithEHM2
from stonesoup.deleter.time import UpdateTimeStepsDeleter
from stonesoup.hypothesiser.distance import DistanceHypothesiser
from stonesoup.hypothesiser.probability import PDAHypothesiser
from stonesoup.initiator.simple import MultiMeasurementInitiator
from stonesoup.measures import Mahalanobis
from stonesoup.models.measurement.linear import LinearGaussian
from stonesoup.models.transition.linear import CombinedLinearGaussianTransitionModel, ConstantVelocity
from stonesoup.predictor.kalman import KalmanPredictor
from stonesoup.tracker.simple import MultiTargetMixtureTracker, MultiTargetTracker
from stonesoup.types.detection import Detection
from stonesoup.types.state import GaussianState
from stonesoup.updater.kalman import KalmanUpdater

ORIGIN = datetime.datetime(2000, 1, 1)


def scans(data: Any, model: LinearGaussian) -> Iterator[tuple[datetime.datetime, set[Detection]]]:
    """Time and detections of each scan."""
    for frame, z in enumerate(np.split(data["z"], data["start"][1:-1])):
        time = ORIGIN + datetime.timedelta(seconds=frame * float(data["dt"]))
        yield time, {Detection(point, timestamp=time, measurement_model=model) for point in z}


def build(method: str, data: Any) -> MultiTargetTracker | MultiTargetMixtureTracker:
    """The tracker; tracks begin with GNN in both."""
    number = {key: float(data[key]) for key in data.files if data[key].ndim == 0}
    model = LinearGaussian(4, (0, 2), np.eye(2) * number["sigma"] ** 2)
    predictor = KalmanPredictor(CombinedLinearGaussianTransitionModel([ConstantVelocity(number["q"])] * 2))
    updater = KalmanUpdater(model)
    reach = np.sqrt(chi2.ppf(number["gate_probability"], 2))
    gnn = GNNWith2DAssignment(DistanceHypothesiser(predictor, updater, Mahalanobis(), missed_distance=reach))
    deleter = UpdateTimeStepsDeleter(int(number["coast_scans"]))
    variances = [number["sigma"] ** 2, number["speed"] ** 2] * 2
    initiator = MultiMeasurementInitiator(
        GaussianState([0, 0, 0, 0], np.diag(variances), timestamp=ORIGIN),
        UpdateTimeStepsDeleter(2),
        gnn,
        updater,
        model,
        min_points=int(number["confirm_hits"]),
    )
    if method == "gnn":
        return MultiTargetTracker(initiator, deleter, scans(data, model), gnn, updater)
    jpda = JPDAwithEHM2(
        PDAHypothesiser(
            predictor,
            updater,
            clutter_spatial_density=number["clutter_density"],
            prob_detect=number["detection_probability"],
            prob_gate=number["gate_probability"],
        )
    )
    return MultiTargetMixtureTracker(initiator, deleter, scans(data, model), jpda, updater)


def main(method: str, data: str, result: str) -> None:
    """Track and store."""
    with np.load(data) as stored:
        identity: dict[str, int] = {}
        rows = [
            (frame, identity.setdefault(track.id, len(identity)), *track.state_vector[[0, 2], 0])
            for frame, (_, tracks) in enumerate(build(method, stored))
            for track in tracks
        ]
    table = np.array(rows, float).reshape(-1, 4)
    np.savez(result, frame=table[:, 0].astype(np.int64), id=table[:, 1].astype(np.int64), xy=table[:, 2:])


if __name__ == "__main__":
    main(*sys.argv[1:])
