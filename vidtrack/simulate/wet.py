"""A wet road: darker, vehicles mirrored below themselves, and spray behind them in the rain."""

from __future__ import annotations

import cv2
import numpy as np

from vidtrack.simulate import draw
from vidtrack.simulate.moment import Canvas, Moment, Placed, pixel_centres, rounded

DARKER = 0.72
MIRRORED = 0.4
SPRAY_SPEED = 20.0  # scene px/s from which a vehicle throws up spray


class Shine:
    """Darken the ground and mirror everybody about the lower edge of their outline."""

    def __call__(self, picture: Canvas, moment: Moment) -> Canvas:
        picture = rounded(DARKER * picture)
        for placed in moment.placed:
            if placed.actor.layer == 0:
                self._mirror(picture, placed, moment.scale)
        return picture

    def _mirror(self, picture: Canvas, placed: Placed, scale: float) -> None:
        foot = placed.corners[:, 1].max()
        flip = np.array([[1.0, 0, 0], [0, -1.0, 2 * foot]])
        corners = draw.apply(flip, placed.corners)
        roi = draw.window(corners, picture, round(4 * scale))
        if roi is None:
            return
        before = picture[roi].astype(np.float32)
        draw.place(picture, placed.sprite, draw.compose(flip, placed.to_picture), corners)
        change = cv2.GaussianBlur(picture[roi] - before, (0, 0), sigmaX=0.8 * scale, sigmaY=2.5 * scale)
        down = np.clip((pixel_centres(*roi)[..., 1] - foot) / np.ptp(placed.corners[:, 1]), 0, 1)
        picture[roi] = rounded(before + MIRRORED * (1 - down)[..., None] * change)


class Spray:
    """A ragged white plume behind each vehicle that is fast enough; it is another one in each frame."""

    def __init__(self, seed: tuple[int, int]) -> None:
        self._seed = seed

    def __call__(self, picture: Canvas, moment: Moment) -> Canvas:
        rng = np.random.default_rng((*self._seed, moment.frame))
        for placed in moment.placed:
            actor = placed.actor
            if not actor.look.headlamps:
                continue
            now, before = actor.path.at(np.array([moment.time_s, moment.time_s - 0.1]))[0]
            speed = np.hypot(*(now - before)) / 0.1
            if speed > SPRAY_SPEED:
                self._plume(picture, placed, min(speed / 60, 1.0), rng)
        return picture

    def _plume(self, picture: Canvas, placed: Placed, strength: float, rng: np.random.Generator) -> None:
        left, top, right, bottom = draw.bounds(placed.actor.look.outline)
        length, half = 0.9 * (right - left), 0.6 * (bottom - top)
        area = np.array([(left - length, -half), (left, -half), (left, half), (left - length, half)])
        roi = draw.window(draw.apply(placed.to_picture, area), picture, 1)
        if roi is None:
            return
        body = placed.to_body(pixel_centres(*roi))
        behind = left - body[..., 0]
        shape = np.where(behind > -2, np.exp(-np.maximum(behind, 0) / (0.4 * length)), 0)
        shape = shape * np.exp(-((body[..., 1] / half) ** 4))
        rows, cols = shape.shape
        coarse = rng.uniform(0.3, 1, (rows // 4 + 2, cols // 4 + 2)).astype(np.float32)
        cover = 0.65 * strength * shape * cv2.resize(coarse, (cols, rows), interpolation=cv2.INTER_LINEAR)
        mist = max(1.8 * float(picture.mean()), 60.0)
        picture[roi] = rounded(picture[roi] + cover[..., None] * (mist - picture[roi].astype(np.float32)))
