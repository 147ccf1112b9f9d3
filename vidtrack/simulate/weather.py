"""What is in the air: fog that thickens with distance, rain with drops on the lens, snow."""

from __future__ import annotations

import cv2
import numpy as np

from vidtrack.simulate.moment import Canvas, Moment, rounded

FOG_LIGHT = 196.0  # grey level of the fog itself
NEAR, FAR = 0.7, 0.15  # light that comes through at the lower and the upper edge
BANKS_PX_S = 6.0  # scene px/s at which banks of fog drift
RAIN_VEIL = 0.85
STREAKS = 90  # per 240x180 px of the scene
LENS_DROPS = 5
FLAKES = 150  # per 240x180 px of the scene
SCENE_AREA = 240 * 180


class Fog:
    """The farther, which is higher in the picture, the more fog; it drifts in banks."""

    def __init__(self, size: tuple[int, int], scale: float, seed: tuple[int, int]) -> None:
        rng = np.random.default_rng(seed)
        self._size = size
        self._through = np.geomspace(FAR, NEAR, size[1], dtype=np.float32)[:, None]
        self._banks = cv2.resize(rng.standard_normal((4, 16), dtype=np.float32), (4 * size[0], size[1]))

    def __call__(self, picture: Canvas, moment: Moment) -> Canvas:
        width = self._size[0]
        start = int(BANKS_PX_S * moment.scale * moment.time_s) % (3 * width)
        through = (self._through ** (1 + 0.1 * self._banks[:, start : start + width]))[..., None]
        return rounded(picture * through + FOG_LIGHT * (1 - through))


class Rain:
    """A grey veil, streaks that are others in each frame, and drops that stay on the lens."""

    def __init__(self, seed: tuple[int, int]) -> None:
        self._seed = seed

    def __call__(self, picture: Canvas, moment: Moment) -> Canvas:
        height, width = picture.shape[:2]
        rng = np.random.default_rng((*self._seed, moment.frame))
        scale = moment.scale
        streaks = np.zeros((height, width), np.uint8)
        count = round(STREAKS * width * height / (SCENE_AREA * scale**2))
        starts = rng.uniform((0, -12 * scale), (width, height), (count, 2))
        lengths = rng.uniform(5, 14, count) * scale
        for start, length in zip(starts, lengths, strict=True):
            end = start + length * np.array([0.18, 1.0])
            ends = [tuple(round(16 * value) for value in point) for point in (start, end)]
            cv2.line(streaks, ends[0], ends[1], (255,), max(1, round(0.5 * scale)), cv2.LINE_AA, 4)
        cover = 0.3 * cv2.GaussianBlur(streaks, (0, 0), 0.6 * scale)[..., None] / np.float32(255)
        grey = float(picture.mean()) + 40
        veiled = RAIN_VEIL * picture + (1 - RAIN_VEIL) * grey
        return self._drops(rounded(veiled + cover * np.maximum(1.6 * grey - veiled, 0)), scale)

    def _drops(self, picture: Canvas, scale: float) -> Canvas:
        """Drops on the lens blur what is behind them and bring light from elsewhere."""
        height, width = picture.shape[:2]
        rng = np.random.default_rng(self._seed)
        mask = np.zeros((height, width), np.float32)
        for x, y, radius in rng.uniform((0, 0, 3), (width, height, 8), (LENS_DROPS, 3)):
            axes = (round(radius * scale), round(1.2 * radius * scale))
            cv2.ellipse(mask, (round(x), round(y)), axes, 0, 0, 360, (1.0,), -1)
        cover = cv2.GaussianBlur(mask, (0, 0), scale)[..., None]
        behind = cv2.GaussianBlur(picture, (0, 0), 4 * scale).astype(np.float32) * 1.12
        return rounded(picture + cover * (behind - picture))


class Snow:
    """Flakes that fall and swing, the nearer the larger and faster, and a faint veil."""

    def __init__(self, size: tuple[int, int], scale: float, seed: tuple[int, int]) -> None:
        rng = np.random.default_rng(seed)
        count = round(FLAKES * size[0] * size[1] / (SCENE_AREA * scale**2))
        self._field = np.array(size) + 20 * scale  # flakes that leave it come in again on the other side
        self._start = rng.uniform(0, 1, (count, 2)) * self._field
        near = rng.uniform(0.3, 1, count) ** 3
        self._radius = 0.5 + 1.6 * near
        self._velocity = np.column_stack([rng.uniform(5, 20, count), rng.uniform(35, 60, count)])
        self._velocity *= (0.6 + 2 * near)[:, None]
        self._phase = rng.uniform(0, 2 * np.pi, count)

    def __call__(self, picture: Canvas, moment: Moment) -> Canvas:
        scale, t = moment.scale, moment.time_s
        swing = np.column_stack([3 * np.sin(3 * t + self._phase), np.zeros(len(self._phase))])
        at = (self._start + scale * (self._velocity * t + swing)) % self._field - 10 * scale
        flakes = np.zeros(picture.shape[:2], np.uint8)
        for (x, y), radius in zip(at, self._radius * scale, strict=True):
            centre, size = (round(16 * x), round(16 * y)), max(round(16 * radius), 8)
            cv2.circle(flakes, centre, size, (255,), -1, cv2.LINE_AA, 4)
        cover = 0.8 * cv2.GaussianBlur(flakes, (0, 0), 0.6 * scale)[..., None] / np.float32(255)
        white = 120 + 0.5 * float(picture.mean())
        veiled = 0.9 * picture + 0.1 * white
        return rounded(veiled + cover * np.maximum(1.15 * white - veiled, 0))
