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
        return lambda model: IMMBank([quiet, model], [settings.quiet_s, settings.manoeuvre_s])
    if settings.estimator == "alpha-beta":
        variance = np.diagonal(found.R, axis1=1, axis2=2).mean()
        return lambda model: FixedGainBank(model, float(np.sqrt(variance)))
    return KalmanBank


def _particles(model: Motion, settings: RadarSettings, seed: int) -> ParticleBank:
    glint = Glint(settings.glint)
    if settings.resampling == "error-signal":
        return ErrorSignalBank(model, settings.particles, glint=glint, seed=seed)
    scheme = Resampling[settings.resampling.upper()]
    return ParticleBank(model, settings.particles, resampling=scheme, glint=glint, seed=seed)
