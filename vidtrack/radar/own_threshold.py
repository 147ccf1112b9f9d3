"""The detection threshold of each track's own, for the plots of a radar (paper 000)."""

from __future__ import annotations

import math

from vidtrack.amplitude.densities import RAYLEIGH, linear
from vidtrack.amplitude.threshold import ThresholdController
from vidtrack.config.radar import RadarSettings
from vidtrack.errors import ConfigError
from vidtrack.radar.scans import Measurements

GATE = 4.0
"""Standard deviations; the gate of the papers, unless a probability is given."""


def controller(settings: RadarSettings, found: Measurements, gate: float) -> ThresholdController:
    """The controller for plots of a radar and a gate [standard deviations].

    Raises ConfigError for plots without amplitudes or with range rates, and for a resolution cell of unknown size.
    """
    assert settings.snr_db is not None
    if found.amplitude is None:
        raise ConfigError("radar.snr_db sets thresholds on amplitudes, but the plots have none; leave it out")
    if found.z.shape[1] != found.dim:
        raise ConfigError("radar.snr_db is for plots without range rates; leave it out")
    sides = (settings.cell_range_m, settings.cell_azimuth_deg, settings.cell_elevation_deg)[: found.dim]
    missing = [
        name
        for name, side in zip(("range_m", "azimuth_deg", "elevation_deg"), sides, strict=False)
        if side is None
    ]  # fmt: skip
    if missing:
        names = " and ".join(f"radar.cell_{name}" for name in missing)
        raise ConfigError(f"radar.snr_db needs the size of a resolution cell; give {names}")
    volume = math.prod(side if k == 0 else math.radians(side) for k, side in enumerate(sides) if side is not None)
    weakest = float(RAYLEIGH.survival(found.amplitude.min()))
    if weakest <= 0:
        raise ConfigError(
            f"radar.snr_db needs amplitudes in deviations of the noise; the least is {found.amplitude.min():.4g}"
        )
    origin = None if found.sensor.angles else settings.position[: found.dim]
    p_fa_max = weakest if settings.pfa_max is None else settings.pfa_max
    return ThresholdController(linear(settings.snr_db), volume, gate, p_fa_max, origin=origin)
