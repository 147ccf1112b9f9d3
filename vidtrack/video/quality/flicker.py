"""Flicker of lamps on alternating current: periodic brightness of the whole picture, or of its rows."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vidtrack.arrays.types import Floats
from vidtrack.video.quality.samples import Samples

_DARK, _BRIGHT = 24, 235  # grey levels between which a ratio means something
_FEWEST, _CYCLES = 32, 4  # pictures, and swings within them, that show a frequency
_OUTSTANDING = 5  # times the median amplitude; noise reaches 3


@dataclass(frozen=True, slots=True)
class Flicker:
    """Flicker; amplitudes are those of a sine, as a share of the light.

    whole         amplitude of the whole picture
    whole_hz      its frequency in the pictures, an alias of the lamps' frequency
    bands         amplitude of rows relative to the whole picture, from a rolling shutter
    bands_hz      its frequency in the pictures
    """

    whole: float = 0.0
    whole_hz: float = 0.0
    bands: float = 0.0
    bands_hz: float = 0.0


def flicker(samples: Samples, rate: float) -> Flicker:
    """Flicker of pictures at a rate [1/s]; zero if there are too few pictures."""
    luma = samples.luma.astype(np.float32)
    if len(luma) < _FEWEST:
        return Flicker()
    scene = np.median(luma, axis=0)
    usable = (scene > _DARK) & (scene < _BRIGHT)
    rows = usable.mean(axis=1) > 0.5  # the other rows are dark, bright or covered
    if not rows.any():
        return Flicker()
    ratio = np.where(usable[rows], luma[:, rows] - samples.black, np.nan) / (scene[rows] - samples.black)
    gain = np.nanmedian(ratio, axis=2)  # (K, h): traffic covers less than half of most rows
    whole = np.median(gain, axis=1)
    return Flicker(*_strongest(whole[:, None], rate), *_strongest(gain / whole[:, None], rate))


def _strongest(gain: Floats, rate: float) -> tuple[float, float]:
    """Amplitude and frequency [Hz] of the strongest significant sine in series (K, N); median over the N series."""
    series = gain - gain.mean(axis=0)
    window = np.hanning(len(series))[:, None]
    amplitude = np.median(np.abs(np.fft.rfft(series * window, axis=0)), axis=1) * 2 / window.sum()
    amplitude[:_CYCLES] = 0  # slower changes are the sun's, and the exposure's
    strongest = int(amplitude.argmax())
    if amplitude[strongest] < _OUTSTANDING * np.median(amplitude[_CYCLES:]):
        return 0.0, 0.0
    return float(amplitude[strongest]), strongest * rate / len(series)
