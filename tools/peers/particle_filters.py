"""Time the particle filters of other libraries on stored measurements; started by a benchmark in their own environment.

    python particle_filters.py PEER DATA.npz RESULT.npz

DATA   z (K,) ranges every `step` seconds, sigma of a range, accel of the target, particles, rounds
RESULT seconds (rounds,) for all K scans, and found (K,) estimates of the last round
A bootstrap filter each: constant velocity with a random acceleration per step, systematic resampling below N / 2.
"""

from __future__ import annotations

import datetime
import sys
from collections.abc import Callable
from time import perf_counter

import numpy as np


def filterpy(z: np.ndarray, step: float, sigma: float, accel: float, number: int) -> Callable[[], np.ndarray]:
    """FilterPy brings the resampling; the rest is NumPy, as its book writes it."""
    from filterpy.monte_carlo import systematic_resample

    def run() -> np.ndarray:
        rng = np.random.default_rng(0)
        x = np.column_stack([z[0] + sigma * rng.standard_normal(number), 200 * rng.standard_normal(number)])
        weight, found = np.full(number, 1 / number), np.empty(len(z))
        for k in range(len(z)):
            a = accel * rng.standard_normal(number)
            x[:, 0] += step * x[:, 1] + step**2 / 2 * a
            x[:, 1] += step * a
            weight *= np.exp(-0.5 * ((z[k] - x[:, 0]) / sigma) ** 2)
            weight += 1e-300
            weight /= weight.sum()
            found[k] = weight @ x[:, 0]
            if 1 / (weight @ weight) < number / 2:
                x = x[systematic_resample(weight)]
                weight[:] = 1 / number
        return found

    return run


def particles(z: np.ndarray, step: float, sigma: float, accel: float, number: int) -> Callable[[], np.ndarray]:
    """`particles`, with the law of motion sampled directly: its own multivariate normal needs a regular covariance."""
    from particles import SMC
    from particles import distributions as dists
    from particles.collectors import Moments
    from particles.state_space_models import Bootstrap, StateSpaceModel

    rng = np.random.default_rng(0)

    class Moved(dists.ProbDist):
        dim = 2

        def __init__(self, x: np.ndarray) -> None:
            self.x = x

        def rvs(self, size: int | None = None) -> np.ndarray:
            a = accel * rng.standard_normal(len(self.x))
            x0, x1 = self.x[:, 0], self.x[:, 1]
            return np.column_stack([x0 + step * x1 + step**2 / 2 * a, x1 + step * a])

    class Flight(StateSpaceModel):
        def PX0(self) -> dists.ProbDist:  # noqa: N802
            return dists.MvNormal(loc=np.array([z[0], 0.0]), cov=np.diag([sigma**2, 200.0**2]))

        def PX(self, t: int, xp: np.ndarray) -> dists.ProbDist:  # noqa: N802
            return Moved(xp)

        def PY(self, t: int, xp: np.ndarray, x: np.ndarray) -> dists.ProbDist:  # noqa: N802
            return dists.Normal(loc=x[:, 0], scale=sigma)

    def run() -> np.ndarray:
        fk = Bootstrap(ssm=Flight(), data=z)
        found = SMC(fk=fk, N=number, resampling="systematic", ESSrmin=0.5, collect=[Moments()])
        found.run()
        return np.array([each["mean"][0] for each in found.summaries.moments])

    return run


def stonesoup(z: np.ndarray, step: float, sigma: float, accel: float, number: int) -> Callable[[], np.ndarray]:
    """Stone Soup's particle predictor, updater and resampler; its noise is continuous, of the same strength."""
    from stonesoup.models.measurement.linear import LinearGaussian
    from stonesoup.models.transition.linear import ConstantVelocity
    from stonesoup.predictor.particle import ParticlePredictor
    from stonesoup.resampler.particle import ESSResampler
    from stonesoup.types.array import StateVectors
    from stonesoup.types.detection import Detection
    from stonesoup.types.hypothesis import SingleHypothesis
    from stonesoup.types.state import ParticleState
    from stonesoup.updater.particle import ParticleUpdater

    start = datetime.datetime(2000, 1, 1)
    model = LinearGaussian(2, (0,), np.array([[sigma**2]]))
    predictor = ParticlePredictor(ConstantVelocity(accel**2 * step))
    updater = ParticleUpdater(model, ESSResampler())

    def run() -> np.ndarray:
        rng = np.random.default_rng(0)
        first = rng.multivariate_normal([z[0], 0.0], np.diag([sigma**2, 200.0**2]), number)
        state = ParticleState(StateVectors(first.T), weight=np.full(number, 1 / number), timestamp=start)
        found = np.empty(len(z))
        for k in range(len(z)):
            at = start + datetime.timedelta(seconds=(k + 1) * step)
            predicted = predictor.predict(state, timestamp=at)
            state = updater.update(SingleHypothesis(predicted, Detection([[z[k]]], at, measurement_model=model)))
            found[k] = state.mean[0, 0]
        return found

    return run


def main(name: str, data: str, result: str) -> None:
    """Run the peer and store what it found."""
    stored = np.load(data)
    run = {"filterpy": filterpy, "particles": particles, "stonesoup": stonesoup}[name](
        stored["z"], *(float(stored[key]) for key in ("step", "sigma", "accel")), int(stored["particles"])
    )
    run()
    seconds = np.empty(int(stored["rounds"]))
    for k in range(len(seconds)):
        begin = perf_counter()
        found = run()
        seconds[k] = perf_counter() - begin
    np.savez(result, seconds=seconds, found=found)


if __name__ == "__main__":
    main(*sys.argv[1:])
