"""Track stored plots with Stone Soup's GNN, PDA or JPDA; started by track_joyride.py and compare_radar.py in the peers'
own environment.

    python plots.py gnn|pda|jpda DATA.npz RESULT.npz [DATA.npz RESULT.npz ...]

DATA   times (K,) [s], plots (N, 2) [m] with the scan (N,) of each, and the models: sigma [m], intensity of the white
       acceleration [m^2/s^3], speed [m/s] of a new track, p_d, p_g, clutter [per m^2], hits, misses
RESULT rows scan, id, x, y of established tracks; cpu_s of tracking
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from datetime import datetime, timedelta
from time import process_time

import numpy as np
from stonesoup.dataassociator.neighbour import GNNWith2DAssignment
from stonesoup.dataassociator.probability import PDA, JPDAwithEHM2
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

BEGIN = datetime(2000, 1, 1)
Data = dict[str, np.ndarray]


def scans(data: Data, sensor: LinearGaussian) -> Iterator[tuple[datetime, set[Detection]]]:
    """Time and detections of each scan."""
    for k, seconds in enumerate(data["times"]):
        time = BEGIN + timedelta(seconds=float(seconds))
        here = data["plots"][data["scan"] == k]
        yield time, {Detection(plot[:, None], timestamp=time, measurement_model=sensor) for plot in here}


def tracker(kind: str, data: Data) -> MultiTargetTracker | MultiTargetMixtureTracker:
    """The tracker, with the models of the data file."""
    sigma, speed, gate = float(data["sigma"]), float(data["speed"]), float(data["p_g"])
    sensor = LinearGaussian(ndim_state=4, mapping=(0, 2), noise_covar=sigma**2 * np.eye(2))
    axis = ConstantVelocity(float(data["intensity"]))
    predictor = KalmanPredictor(CombinedLinearGaussianTransitionModel([axis, axis]))
    updater = KalmanUpdater(sensor)
    deleter = UpdateTimeStepsDeleter(int(data["misses"]))
    nearest = DistanceHypothesiser(predictor, updater, Mahalanobis(), missed_distance=np.sqrt(-2 * np.log(1 - gate)))
    initiator = MultiMeasurementInitiator(
        prior_state=GaussianState(np.zeros((4, 1)), np.diag([0, speed**2, 0, speed**2])),
        deleter=UpdateTimeStepsDeleter(2),
        data_associator=GNNWith2DAssignment(nearest),
        updater=updater,
        measurement_model=sensor,
        min_points=int(data["hits"]),
    )
    if kind == "gnn":
        return MultiTargetTracker(initiator, deleter, scans(data, sensor), GNNWith2DAssignment(nearest), updater)
    weigh = PDAHypothesiser(
        predictor,
        updater,
        clutter_spatial_density=float(data["clutter"]),
        prob_detect=float(data["p_d"]),
        prob_gate=gate,
    )
    associate = (JPDAwithEHM2 if kind == "jpda" else PDA)(weigh)
    return MultiTargetMixtureTracker(initiator, deleter, scans(data, sensor), associate, updater)


def main() -> None:
    """Track and write the rows of each pair of files."""
    kind, *files = sys.argv[1:]
    for given, result in zip(files[::2], files[1::2], strict=True):
        track(kind, given, result)


def track(kind: str, given: str, result: str) -> None:
    """Track what a file holds and write the rows into another."""
    numbers: dict[str, int] = {}
    rows = []
    with np.load(given) as stored:
        data = dict(stored)
        began = process_time()
        for k, (_, tracks) in enumerate(tracker(kind, data)):
            for track in tracks:
                x, _, y, _ = np.ravel(track.state_vector).astype(float)
                rows.append((k, numbers.setdefault(track.id, len(numbers) + 1), x, y))
    np.savez(result, rows=np.array(rows).reshape(-1, 4), cpu_s=process_time() - began)


if __name__ == "__main__":
    main()
