"""Advice on light, noise and compression."""

from __future__ import annotations

from collections.abc import Iterator

from vidtrack.config.settings import Settings
from vidtrack.config.video import DisturbanceSettings
from vidtrack.doctor.advice import Advice, scale_option, set_option
from vidtrack.doctor.findings import Findings
from vidtrack.video.background.picture import reduction
from vidtrack.video.quality.flicker import Flicker
from vidtrack.video.quality.light import Light

_THRESHOLD = "detector.disturbance.luma_threshold"
_DIM, _BLACK = 100.0, 25.0  # 95th percentile of the grey level
_DAYLIGHT = 165.0  # the same in daylight, where the default threshold is right
_LEAST_THRESHOLD = 5
_NOISE = 18.0  # grey levels in a processed pixel; from 20 on it becomes foreground
_FLICKER, _BANDS = 0.1, 0.08  # amplitudes
_BAND_THRESHOLDS = 25, 40  # below, edges of bands become foreground; above, vehicles are missed
_CLIPPED = 0.15  # of the picture
_BLOCKS = 1.3


def on_noise(findings: Findings, settings: Settings) -> Iterator[Advice]:
    """Advice on the sensor's noise."""
    step = reduction(findings.height, settings.source.scale)
    if findings.light is not None and findings.light.noise / step > _NOISE:
        text = f"each pixel varies by {findings.light.noise:.0f} grey levels: noise is taken for traffic"
        yield Advice("noise", True, f"{text}; a reduced picture averages it", (scale_option(2 * step),))


def on_pictures(findings: Findings, settings: Settings) -> Iterator[Advice]:
    """Advice on light, flicker and compression."""
    if findings.light is not None:
        yield from _on_light(findings.light, settings)
        if findings.flicker is not None:
            yield from _on_flicker(findings.flicker, findings.light, settings)
    if findings.blockiness is not None and findings.blockiness > _BLOCKS:
        text = f"steps at the blocks of the compression are {findings.blockiness:.1f} times those elsewhere"
        yield Advice("compression", False, f"{text}: outlines of small vehicles are rough; more bits help")


def _on_light(light: Light, settings: Settings) -> Iterator[Advice]:
    now = settings.detector.disturbance.luma_threshold
    fitting = max(_LEAST_THRESHOLD, round(DisturbanceSettings().luma_threshold * light.bright / _DAYLIGHT))
    if light.bright < _BLACK:
        text = (
            f"the picture is black, 95 % of it below {light.bright:.0f} of 255: no setting finds vehicles without lamps"
        )
        yield Advice("dark", True, f"{text}; a longer exposure or more light would")
    elif light.bright < _DIM and fitting < now:
        text = (
            f"the picture is dark, 95 % of it below {light.bright:.0f} of 255: dim vehicles differ too little from it"
        )
        yield Advice("dark", True, text, (set_option(_THRESHOLD, fitting),))
    if light.white_share > _CLIPPED:
        text = f"{light.white_share:.0%} of the picture is white: bright vehicles cannot be seen there"
        yield Advice("glare", False, f"{text}; a shorter exposure would show them")


def _on_flicker(flicker: Flicker, light: Light, settings: Settings) -> Iterator[Advice]:
    if flicker.whole > _FLICKER:
        text = f"the light swings by {flicker.whole:.0%} at {flicker.whole_hz:.1f} Hz"
        if settings.detector.disturbance.exposure:
            yield Advice("flicker", False, f"{text}: lamps; the detector follows it")
        else:
            yield Advice("flicker", True, f"{text}: lamps", (set_option("detector.disturbance.exposure", True),))
    if flicker.bands > _BANDS:
        text = f"bands of light run through the picture, {flicker.bands:.0%} bright: lamps and a shutter that differ"
        least, most = _BAND_THRESHOLDS
        threshold = min(most, max(least, round(1.2 * flicker.bands * light.brightness) + 5))
        if settings.detector.disturbance.luma_threshold < threshold:
            yield Advice(
                "bands",
                True,
                f"{text}; set the camera to the mains frequency (1/50 or 1/100 s, 1/60 or 1/120 s), until then",
                (set_option(_THRESHOLD, threshold),),
            )
