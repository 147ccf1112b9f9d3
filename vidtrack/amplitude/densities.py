"""Densities of target and clutter amplitudes, P_D and P_FA.

An amplitude a is the envelope in units of the noise's in-phase standard deviation, so that noise alone has the
density a exp(-a^2 / 2) and a square-law detector's power, with noise mean one, is a^2 / 2.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from vidtrack.arrays.types import Floats
from vidtrack.errors import ConfigError


@dataclass(frozen=True, slots=True)
class Weibull:
    """Amplitudes with P(a > t) = exp(-rate t^shape): the b and c of paper 002.

    Shape 2 is Rayleigh: receiver noise with rate 1/2, a Swerling I target with rate 1 / (2 + 2 SNR). Smaller
    shapes have heavier tails: sea and ground clutter at low grazing angles.

    Raises ConfigError for a shape outside 0.1..10 or a rate outside 1e-12..1e12.
    """

    shape: float = 2.0
    rate: float = 0.5

    def __post_init__(self) -> None:
        if not 0.1 <= self.shape <= 10:
            raise ConfigError(f"Weibull amplitudes: the shape is {self.shape}; it must lie in 0.1..10")
        if not 1e-12 <= self.rate <= 1e12:
            raise ConfigError(f"Weibull amplitudes: the rate is {self.rate}; it must lie in 1e-12..1e12")

    def log_survival(self, a: ArrayLike) -> Floats:
        """ln P(amplitude > a)."""
        return np.asarray(-self.rate * np.asarray(a, float) ** self.shape)

    def survival(self, a: ArrayLike) -> Floats:
        """P(amplitude > a)."""
        return np.asarray(np.exp(self.log_survival(a)))

    def log_pdf(self, a: ArrayLike) -> Floats:
        """ln p(a), a > 0."""
        log_a = np.log(a)
        return np.asarray(np.log(self.rate * self.shape) + (self.shape - 1) * log_a + self.log_survival(a))

    def pdf(self, a: ArrayLike) -> Floats:
        """p(a) = shape rate a^(shape - 1) exp(-rate a^shape), a > 0."""
        return np.asarray(np.exp(self.log_pdf(a)))

    def threshold(self, probability: ArrayLike) -> Floats:
        """The amplitude exceeded with this probability; for clutter, the threshold of a P_FA."""
        return np.asarray((-np.log(probability) / self.rate) ** (1 / self.shape))

    def sample(self, rng: np.random.Generator, size: int | tuple[int, ...], above: ArrayLike = 0.0) -> Floats:
        """Amplitudes that exceed `above` (scalar or of that size), by inverting the survival function."""
        exponent = self.rate * np.asarray(above, float) ** self.shape + rng.standard_exponential(size)
        return np.asarray((exponent / self.rate) ** (1 / self.shape))


RAYLEIGH = Weibull()
"""Receiver noise: unit variance in phase and in quadrature."""


def swerling1(snr: float) -> Weibull:
    """Amplitudes of a Swerling I target in noise; snr: mean power ratio, linear.

    Raises ConfigError for an SNR that is negative or not finite.
    """
    if not (np.isfinite(snr) and snr >= 0):
        raise ConfigError(f"the linear SNR is {snr}; it must be zero or more")
    return Weibull(2.0, 0.5 / (1 + snr))


def linear(db: float) -> float:
    """A ratio of powers from its decibels: 10 dB is 10, 13 dB is 19.95."""
    return float(10 ** (db / 10))


def detection_probability(p_fa: ArrayLike, snr: float, clutter: Weibull = RAYLEIGH) -> Floats:
    """P_D of a Swerling I target at the threshold that clutter exceeds with probability p_fa.

    It is P_FA^(1 / (1 + SNR)) in Rayleigh clutter only (paper 002).
    """
    return swerling1(snr).survival(clutter.threshold(p_fa))


def false_alarm_probability(p_d: ArrayLike, snr: float, clutter: Weibull = RAYLEIGH) -> Floats:
    """P_FA at the threshold that detects a Swerling I target with probability p_d."""
    return clutter.survival(swerling1(snr).threshold(p_d))


def log_ratio(a: ArrayLike, threshold: ArrayLike, target: Weibull, clutter: Weibull = RAYLEIGH) -> Floats:
    """ln r(a) = ln p_T(a) - ln p_F(a), both densities given that the threshold was exceeded (paper 002, 12 and 13).

    In logarithms, because r overflows for strong echoes.
    """
    given = target.log_survival(threshold) - clutter.log_survival(threshold)
    return np.asarray(target.log_pdf(a) - clutter.log_pdf(a) - given)
