"""Time Stone Soup's JPDA on stored association problems; started by a benchmark in the peers' own environment.

    python associate.py PEER DATA.npz RESULT.npz

DATA   zhat (T, 2) and cov (T, 2, 2) of the predicted positions, z (M, 2), R (2, 2), detection, clutter, gate
       (probabilities and density), rounds
RESULT seconds (rounds,) of the association, its hypotheses' generation included, and weights (T, 1 + M), those of a
       miss in front
"""

from __future__ import annotations

import datetime
import sys
from time import perf_counter

import numpy as np
from stonesoup.dataassociator.probability import JPDA, JPDAwithEHM2, JPDAwithLBP
from stonesoup.hypothesiser.probability import PDAHypothesiser
from stonesoup.models.measurement.linear import LinearGaussian
from stonesoup.models.transition.linear import CombinedLinearGaussianTransitionModel, RandomWalk
from stonesoup.predictor.kalman import KalmanPredictor
from stonesoup.types.detection import Detection
from stonesoup.types.state import GaussianState
from stonesoup.types.track import Track
from stonesoup.updater.kalman import KalmanUpdater

PEERS = {"jpda": JPDA, "ehm2": JPDAwithEHM2, "lbp": JPDAwithLBP}


def main(name: str, data: str, result: str) -> None:
    """Run the peer and store what it found."""
    stored = np.load(data)
    time = datetime.datetime(2000, 1, 1)
    model = LinearGaussian(2, (0, 1), stored["R"])
    hypothesiser = PDAHypothesiser(
        KalmanPredictor(CombinedLinearGaussianTransitionModel([RandomWalk(0.0)] * 2)),
        KalmanUpdater(model),
        clutter_spatial_density=float(stored["clutter"]),
        prob_detect=float(stored["detection"]),
        prob_gate=float(stored["gate"]),
    )
    tracks = [Track([GaussianState(x, P, timestamp=time)]) for x, P in zip(stored["zhat"], stored["cov"], strict=True)]
    detections = [
        Detection(z, timestamp=time, measurement_model=model, metadata={"index": j}) for j, z in enumerate(stored["z"])
    ]
    associator = PEERS[name](hypothesiser)
    seconds = np.empty(int(stored["rounds"]))
    for k in range(len(seconds)):
        begin = perf_counter()
        found = associator.associate(set(tracks), set(detections), time)
        seconds[k] = perf_counter() - begin
    weights = np.zeros((len(tracks), 1 + len(detections)))
    for t, track in enumerate(tracks):
        for hypothesis in found[track]:
            j = 1 + hypothesis.measurement.metadata["index"] if hypothesis else 0
            weights[t, j] = float(hypothesis.probability)
    np.savez(result, seconds=seconds, weights=weights / weights.sum(axis=1, keepdims=True))


if __name__ == "__main__":
    main(*sys.argv[1:])
