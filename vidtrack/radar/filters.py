"""Motion models and estimators by their names in the settings, in metres and seconds."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np

from vidtrack.config.radar import RadarSettings
from vidtrack.estimate.bank import Estimator
from vidtrack.estimate.error_signal import ErrorSignalBank
from vidtrack.estimate.fixed_gain import FixedGainBank
from vidtrack.estimate.imm import IMMBank
from vidtrack.estimate.kalman import KalmanBank
from vidtrack.estimate.motion.acceleration import ConstantAcceleration, Singer
from vidtrack.estimate.motion.model import Motion
from vidtrack.estimate.motion.turn import CoordinatedTurn
from vidtrack.estimate.motion.velocity import ConstantVelocity
from vidtrack.estimate.particle import Glint, ParticleBank
from vidtrack.estimate.resampling import Resampling
from vidtrack.estimate.unscented import UnscentedBank
from vidtrack.radar.scans import Measurements

AGILE_S = 20.0
"""s; mean time that each mode of an agile target lasts."""
HARDER = 1.5
"""Acceleration of agile targets, over that of others."""
BECOMES_S, REMAINS_S = 5000.0, 1000.0
"""s; mean times after which a target becomes agile, and after which it is so no longer."""
HEED = 2.0
"""By how much the odds of a manoeuvre are raised in gates and weights: a plot too many costs less than a lost track."""


def motion(settings: RadarSettings, dim: int) -> Motion:
    """The motion model of the settings."""
    speed, accel, hold_s = settings.max_speed / 2, settings.accel, settings.hold_s
    model = settings.model or ("ct" if settings.estimator == "imm" else "cv")
    if model == "ca":
        return ConstantAcceleration(dim, change=accel, hold_s=hold_s, speed=speed, accel=accel)
    if model == "singer":
        return Singer(dim, accel=accel, hold_s=hold_s, speed=speed)
    if model == "ct":
        return CoordinatedTurn(dim, accel=accel, hold_s=hold_s, speed=speed)
    return ConstantVelocity(dim, accel=accel, hold_s=hold_s, speed=speed)


def estimator(settings: RadarSettings, found: Measurements, seed: int = 0) -> Callable[[Motion], Estimator]:
    """A factory of the settings' bank of filters from a motion model; seed: for particles."""
    if settings.estimator == "ukf":
        return UnscentedBank
    if settings.estimator == "particle":
        return partial(_particles, settings=settings, seed=seed)
    if settings.estimator == "imm":
        quiet = ConstantVelocity(
            found.dim, accel=settings.quiet_accel, hold_s=settings.hold_s, speed=settings.max_speed / 2
        )
        return partial(_imm, quiet=quiet, settings=settings)
    if settings.estimator == "alpha-beta":
        variance = np.diagonal(found.R, axis1=1, axis2=2).mean()
        return lambda model: FixedGainBank(model, float(np.sqrt(variance)))
    return KalmanBank


def _imm(model: Motion, quiet: Motion, settings: RadarSettings) -> IMMBank:
    """The quiet mode and the model's, as targets have them that seldom manoeuvre, and again as agile targets do.

    Plots tell which kind a target is, so that the errors of one that manoeuvres all the time are stated larger, and
    those of others are not.
    """
    rest, turn, share = settings.quiet_s, settings.manoeuvre_s, settings.agile
    if share == 0:
        return IMMBank([quiet, model], [rest, turn], heed=[1, HEED])
    harder = motion(settings.model_copy(update={"accel": HARDER * settings.accel}), model.dim)
    rates = np.array([
        [0, 1 / rest, 1 / BECOMES_S, 0],
        [1 / turn, 0, 0, 1 / BECOMES_S],
        [1 / REMAINS_S, 0, 0, 1 / AGILE_S],
        [0, 1 / REMAINS_S, 1 / AGILE_S, 0],
    ])  # fmt: skip
    usual = (1 - share) / (rest + turn)
    prior = np.array([usual * rest, usual * turn, share / 2, share / 2])
    return IMMBank([quiet, model, quiet, harder], rates=rates, prior=prior, kinds=[0, 0, 1, 1], heed=[1, HEED, 1, 1])


def _particles(model: Motion, settings: RadarSettings, seed: int) -> ParticleBank:
    glint = Glint(settings.glint)
    if settings.resampling == "error-signal":
        return ErrorSignalBank(model, settings.particles, glint=glint, seed=seed)
    scheme = Resampling[settings.resampling.upper()]
    return ParticleBank(model, settings.particles, resampling=scheme, glint=glint, seed=seed)
