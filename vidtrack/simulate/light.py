"""A low sun with its glare; dusk and night with headlamps, tail lamps, street lamps and the noise of few photons."""

from __future__ import annotations

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from vidtrack.arrays.types import Floats
from vidtrack.simulate import draw
from vidtrack.simulate.moment import Canvas, Moment, Placed, pixel_centres, rounded

AMBIENT = {"dusk": 0.35, "night": 0.12}  # share of the day's light
LOW_SUN_SHADOW = 0.35  # light left in its shadows
WARM = np.array([0.86, 0.97, 1.06], np.float32)
REACH_PX = 34.0  # scene px over which a beam fades to a third
BEAM = np.array([0.85, 0.97, 1.0], np.float32)
RED = np.array([0.15, 0.12, 1.0], np.float32)
SHOT = 0.5  # variance of the noise per grey level in low light
STREET_LAMPS = 3


def low_sun(rng: Generator) -> tuple[float, float]:
    """A shadow's offset per pixel of height: long, and towards the camera, which looks against the light."""
    angle, length = rng.uniform(np.radians(25), np.radians(155)), rng.uniform(2.2, 3.2)
    return float(length * np.cos(angle)), float(length * np.sin(angle))


class Glare:
    """Warm light, and a veil that is brightest at the edge where the sun stands."""

    def __init__(self, sun: tuple[float, float], size: tuple[int, int]) -> None:
        middle = np.array(size) / 2
        place = middle - np.array(sun) / np.hypot(*sun) * middle * 1.2
        away = np.linalg.norm((pixel_centres(slice(0, size[1]), slice(0, size[0])) - place) / size[0], axis=-1)
        self._veil = (30 + 150 * np.exp(-((away / 0.33) ** 2)))[..., None].astype(np.float32)

    def __call__(self, picture: Canvas, moment: Moment) -> Canvas:
        return rounded(0.85 * picture * WARM + self._veil)


class Lamplight:
    """Little light of the sky, and lamps: beams on the road ahead of each vehicle, lamps in their glow.

    ambient       share of the day's light
    street_lamps  pools of light that stand still
    wet           lamps are mirrored in the road below them
    """

    def __init__(
        self,
        ambient: float,
        size: tuple[int, int],
        scale: float,
        seed: tuple[int, int],
        *,
        street_lamps: bool,
        wet: bool,
    ) -> None:
        self._ambient, self._size, self._wet = ambient, size, wet
        rng = np.random.default_rng(seed)
        count = STREET_LAMPS if street_lamps else 0
        self._pools = rng.uniform(0.1, 0.9, (count, 2)) * size
        self._radius = 55 * scale

    def __call__(self, picture: Canvas, moment: Moment) -> Canvas:
        width, height = self._size
        lit = np.full((height, width, 3), self._ambient, np.float32) * np.array([1.15, 1.0, 0.9], np.float32)
        at = pixel_centres(slice(0, height), slice(0, width))
        for pool in self._pools + moment.shake:
            pool_light = np.exp(-((at - pool) ** 2).sum(-1) / self._radius**2)
            lit += 0.22 * pool_light[..., None].astype(np.float32) * WARM
        glow = np.zeros_like(lit)
        for placed in moment.placed:
            self._add_beams(lit, placed, moment.scale)
            self._add_lamps(glow, placed, moment.scale)
        return rounded(picture * lit + glow)

    def _add_beams(self, lit: NDArray[np.float32], placed: Placed, scale: float) -> None:
        """Light the road ahead of the headlamps."""
        far = 3 * REACH_PX
        for x, y in placed.actor.look.headlamps:
            cone = np.array([(x, y - 4), (x, y + 4), (x + far, y + 0.5 * far), (x + far, y - 0.5 * far)])
            roi = draw.window(draw.apply(placed.to_picture, cone), lit, 1)
            if roi is None:
                continue
            body = placed.to_body(pixel_centres(*roi))
            ahead, aside = body[..., 0] - x, body[..., 1] - y
            fades = np.exp(-ahead / REACH_PX) * np.clip(ahead / 6, 0, 1)
            spread = np.exp(-((aside / (3 + 0.22 * np.maximum(ahead, 0))) ** 2))
            lit[roi] += 0.8 * (np.where(ahead > 0, fades, 0) * spread)[..., None] * BEAM

    def _add_lamps(self, glow: NDArray[np.float32], placed: Placed, scale: float) -> None:
        """Draw each lamp with its halo, and its reflection."""
        look = placed.actor.look
        for lamps, colour, power in ((look.headlamps, BEAM, 255.0), (look.tail_lamps, RED, 150.0)):
            for lamp in lamps:
                at = draw.apply(placed.to_picture, np.array(lamp))
                add_spot(glow, at, (1.3 * scale, 1.3 * scale), power * colour)
                add_spot(glow, at, (4 * scale, 4 * scale), 0.18 * power * colour)
                if self._wet:
                    add_spot(glow, at + np.array([0, 9 * scale]), (1.6 * scale, 7 * scale), 0.4 * power * colour)


class ShotNoise:
    """Noise whose variance grows with the light, as where a camera's gain is high."""

    def __init__(self, seed: tuple[int, int]) -> None:
        self._seed = seed

    def __call__(self, picture: Canvas, moment: Moment) -> Canvas:
        rng = np.random.default_rng((*self._seed, moment.frame))
        sigma = np.sqrt(SHOT * (picture + np.float32(6)))
        return rounded(picture + sigma * rng.standard_normal(picture.shape, dtype=np.float32))


def add_spot(glow: NDArray[np.float32], at: Floats, sigma: tuple[float, float], colour: NDArray[np.float32]) -> None:
    """Add a Gaussian spot of light."""
    reach = 3 * np.array(sigma)
    roi = draw.window(np.stack([at - reach, at + reach]), glow, 0)
    if roi is not None:
        away = (pixel_centres(*roi) - at) / sigma
        glow[roi] += np.exp(-0.5 * (away**2).sum(-1))[..., None].astype(np.float32) * colour
