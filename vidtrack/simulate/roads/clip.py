"""A clip of a road: frames drawn when asked for, traffic and truth known beforehand."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime, timedelta
from functools import cached_property

import cv2
import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays.types import Floats
from vidtrack.errors import ConfigError
from vidtrack.simulate import draw as flat
from vidtrack.simulate.camera import Camera, camera
from vidtrack.simulate.clip import Frames, check_camera
from vidtrack.simulate.clock import burn_in
from vidtrack.simulate.conditions import Conditions, Effect
from vidtrack.simulate.draw import SHADOW, Image
from vidtrack.simulate.light import LOW_SUN_SHADOW, Glare
from vidtrack.simulate.moment import Moment
from vidtrack.simulate.roads import lamps
from vidtrack.simulate.roads.history import History, States
from vidtrack.simulate.roads.layout import Layout
from vidtrack.simulate.roads.pinhole import Pinhole, pinhole
from vidtrack.simulate.roads.scenarios import ROADS
from vidtrack.simulate.roads.scenery import empty_road
from vidtrack.simulate.roads.solids import Solid, solid
from vidtrack.simulate.roads.stage import Actor, draw, fill, footprints, painted, stage
from vidtrack.simulate.roads.traffic import drive
from vidtrack.simulate.roads.truth import RoadTruth, numbered, visible_share
from vidtrack.simulate.roads.vehicles import Fleet
from vidtrack.simulate.truth import Truth
from vidtrack.simulate.wet import DARKER

START = datetime.fromisoformat("2026-06-01T07:00:00+02:00")
SIZE, FPS, SECONDS, HEIGHT_M = (1280, 720), 25.0, 60.0, 8.0
VIEW = np.radians(60)
LEAST_POINTS = 4  # on the road that the camera must show, to calibrate it
ROUGH_ROWS = 360  # rows of a picture in which a wet road blurs by 3 x 9 px
AIR_PX = 512.0  # width of a picture in which rain and snow have the size of the flat scenarios
MIRRORED, MIRROR_LIGHT = 0.3, 0.7  # share of a wet road's light that is mirrored, and what that loses


@dataclass(frozen=True, eq=False)
class RoadClip(Frames):
    """A road seen by a camera.

    eye     the camera's place and lens; `camera` is its picture's shake, exposure and noise
    sun     (3,) unit vector towards the sun; None: overcast, or dark
    click_sigma  px; standard deviation of the clicked points
    """

    name: str
    layout: Layout
    eye: Pinhole
    camera: Camera
    fps: float
    times: Floats
    seed: int
    conditions: Conditions
    history: History
    fleet: Fleet
    sun: Floats | None
    click_sigma: float

    @cached_property
    def truth(self) -> RoadTruth:
        """Of all vehicles of which at least a pixel is in the picture, in all frames."""
        rows, boxes = [], []
        for k, time in enumerate(self.times):
            states = self.history.at(time)
            actors = self.actors(states, k)
            for place, actor in enumerate(actors):
                left_top, right_bottom = np.clip(actor.box.reshape(2, 2), 0, self.size)
                if (right_bottom - left_top < 1).any():
                    continue
                share = visible_share(actor, actors[place + 1 :], self.size)
                boxes.append([*left_top, *(right_bottom - left_top), share, *(actor.box[:2] + actor.box[2:]) / 2])
                row = actor.row
                state = states.speed[row], states.heading[row], *states.xy[row]
                rows.append([k, time, states.vehicle[row], *state])
        table, box = np.array(rows).reshape(-1, 7), np.array(boxes).reshape(-1, 7)
        vehicle = table[:, 2].astype(np.int64)
        order = np.lexsort((numbered(vehicle), table[:, 0]))
        table, box, vehicle = table[order], box[order], vehicle[order]
        frame = table[:, 0].astype(np.int64)
        seen = Truth(frame, table[:, 1], numbered(vehicle), box[:, :4], box[:, 4], box[:, 5:])
        return RoadTruth(seen, vehicle, table[:, 5:], table[:, 3], table[:, 4])

    def actors(self, states: States, k: int) -> list[Actor]:
        """The vehicles that frame k may show, from the farthest to the nearest."""
        solids = [self._solid(int(vehicle)) for vehicle in states.vehicle]
        length, width = self.fleet.length[states.vehicle], self.fleet.width[states.vehicle]
        seen = stage(solids, states.xy, states.heading, self._view(k), self.size)
        return painted(seen, footprints(states.xy, states.heading, length, width), self.eye.position[:2])

    def frame(self, k: int) -> NDArray[np.uint8]:
        """Frame k, (H, W, 3) BGR."""
        view = self._view(k)
        actors = self.actors(self.history.at(self.times[k]), k)
        picture = self.camera.framed(self._ground, k)
        if self.conditions.shining:
            self._mirror(picture, actors, view)
        if self.sun is not None:
            self._shade(picture, actors, view, self.sun)
        for actor in actors:
            draw(picture, actor, view, self.sun)
        if self.conditions.dark:
            picture = lamps.lit(picture, actors, view, self.conditions.light, self._pools, self.conditions.shining)
        moment = Moment(k, self.times[k], self._air_scale, self.camera.shake[k], ())
        for effect in self._above:
            picture = effect(picture, moment)
        picture = self.camera.exposed(picture, k)
        if self.conditions.clock:
            burn_in(picture, START + timedelta(seconds=float(self.times[k])))
        return picture

    def _view(self, k: int) -> Pinhole:
        return self.eye.shifted(self.camera.shake[k])

    def _shade(self, picture: Image, actors: list[Actor], view: Pinhole, sun: Floats) -> None:
        """Darken the ground where a vehicle stands between it and the sun."""
        left = LOW_SUN_SHADOW if self.conditions.light == "low-sun" else SHADOW
        mask, windows = np.zeros(picture.shape[:2], np.uint8), []
        for actor in actors:
            for polygon in actor.shadow(sun):
                xy, depth = view.project(np.column_stack([polygon, np.zeros(len(polygon))]))
                window = flat.window(xy, mask, 2)
                if depth.min() > 1 and window is not None:
                    fill(mask, xy)
                    windows.append(window)
        bright = picture.copy()
        for window in windows:
            cover = cv2.blur(mask[window], (3, 3)).astype(np.float32)[..., None]
            picture[window] = np.rint(bright[window] * (1 - (1 - left) / 255 * cover))

    def _mirror(self, picture: Image, actors: list[Actor], view: Pinhole) -> None:
        """Mirror the vehicles in the wet road, blurred as a rough surface does."""
        mirrored = picture.copy()
        for actor in actors:
            colour = MIRROR_LIGHT * actor.solid.colours[~actor.solid.glows].mean(axis=0)
            for polygon in actor.mirrored(view):
                cv2.fillConvexPoly(mirrored, np.rint(polygon - 0.5).astype(np.int32), colour.tolist())
        rough = self.size[1] / ROUGH_ROWS
        mirrored = np.asarray(cv2.blur(mirrored, (max(1, round(3 * rough)), max(1, round(9 * rough)))))
        cv2.addWeighted(picture, 1 - MIRRORED, mirrored, MIRRORED, 0, dst=picture)

    @cached_property
    def _ground(self) -> Image:
        margin = self.camera.margin
        size = self.size[0] + 2 * margin, self.size[1] + 2 * margin
        view = self.eye.shifted(np.full(2, float(margin)))
        ground = empty_road(self.layout.ground, view, size, np.random.default_rng((self.seed, 1)))
        return np.rint(DARKER * ground).astype(np.uint8) if self.conditions.shining else ground

    @cached_property
    def _pools(self) -> NDArray[np.float32] | None:
        if self.conditions.light != "night":
            return None
        return lamps.street_lamps(self.layout.survey[::5], self.eye, self.size)

    @property
    def _air_scale(self) -> float:
        return self.size[0] / AIR_PX

    @cached_property
    def _above(self) -> list[Effect]:
        effects: list[Effect] = []
        if self.conditions.light == "low-sun" and self.sun is not None:
            aim = np.array([*self.layout.aim, 0.0])
            thrown = aim - np.array([*self.sun[:2], 0.0])
            shadow = self.eye.project(thrown)[0] - self.eye.project(aim)[0]
            effects.append(Glare((float(shadow[0]), float(shadow[1])), self.size))
        return effects + self.conditions.air(self.size, self._air_scale, self.seed)

    def _solid(self, vehicle: int) -> Solid:
        if vehicle not in self._solids:
            self._solids[vehicle] = solid(self.fleet, vehicle)
        return self._solids[vehicle]

    @cached_property
    def _solids(self) -> dict[int, Solid]:
        return {}


def simulate_road(
    name: str,
    *,
    seed: int = 0,
    fps: float | None = None,
    size: tuple[int, int] | None = None,
    seconds: float | None = None,
    flow: float | None = None,
    camera_height: float = HEIGHT_M,
    tilt_deg: float | None = None,
    lens: float = 0.0,
    click_sigma: float = 1.0,
    noise: float = 2.0,
    shake: float = 0.0,
    light_steps: int = 0,
    weather: str = "clear",
    light: str = "day",
    wet: bool = False,
    clock: bool = False,
) -> RoadClip:
    """A clip of `name`: road, junction-3d, roundabout or motorway.

    seconds        of video; None: 60
    flow           vehicles/h in all; None: the scenario's own
    camera_height  m above the road; the camera's axis always meets the road in the same point
    tilt_deg       of the axis below the horizon; None: the scenario's own
    lens           k1 of Brown-Conrady; negative: barrel
    click_sigma    px; standard deviation of the clicked calibration points, per axis
    The others are as in `vidtrack.simulate.simulate`.

    Raises ConfigError for an unknown name, a value out of range, or a camera that sees too little of the road.
    """
    check_camera(seed, fps, size, noise, shake, light_steps)
    _check(name, seconds, flow, camera_height, tilt_deg, lens, click_sigma)
    conditions = Conditions(weather, light, wet, clock=clock)
    conditions.check(trees=False)
    traffic_rng, camera_rng, sun_rng = np.random.default_rng(seed).spawn(3)
    layout, rate, shape = ROADS[name](), fps or FPS, size or SIZE
    times = np.arange(max(1, round((seconds or SECONDS) * rate))) / rate
    tilt = layout.tilt if tilt_deg is None else np.radians(tilt_deg)
    eye = pinhole(layout.aim, layout.azimuth, tilt, camera_height, shape, VIEW, lens)
    seen = int(eye.shows(layout.survey, shape).sum())
    if seen < LEAST_POINTS:
        raise ConfigError(
            f"the camera shows {seen} of the points to calibrate it with, and {LEAST_POINTS} are needed; "
            "choose another camera_height or tilt_deg"
        )
    history, fleet = drive(layout.network, flow or layout.flow, -layout.warm_s, float(times[-1]), traffic_rng)
    view = camera(shape, shape, times, camera_rng, noise=noise, shake=shake, light_steps=light_steps)
    sun = _sun(conditions, layout.azimuth, sun_rng)
    return RoadClip(name, layout, eye, view, rate, times, seed, conditions, history, fleet, sun, click_sigma)


def _sun(conditions: Conditions, azimuth: float, rng: np.random.Generator) -> Floats | None:
    """Unit vector to the sun; a low one stands opposite the camera."""
    if conditions.dark or conditions.weather != "clear":
        return None
    if conditions.light == "low-sun":
        towards, up = azimuth + rng.uniform(-1.0, 1.0), np.radians(rng.uniform(16, 22))
    else:
        towards, up = rng.uniform(0, 2 * np.pi), np.radians(rng.uniform(38, 60))
    return np.array([np.cos(up) * np.cos(towards), np.cos(up) * np.sin(towards), np.sin(up)])


_RANGES = {
    "seconds": (1.0, 86400.0, "s"),
    "flow": (1.0, 12000.0, "vehicles/h"),
    "camera_height": (5.0, 50.0, "m"),
    "tilt_deg": (8.0, 80.0, "degrees"),
    "lens": (-0.3, 0.3, ""),
    "click_sigma": (0.0, 50.0, "px"),
}


def _check(name: str, *values: float | None) -> None:
    if name not in ROADS:
        raise ConfigError(f"no road is called {name!r}; there are {', '.join(ROADS)}")
    for (what, (low, high, unit)), value in zip(_RANGES.items(), values, strict=True):
        if value is not None and not low <= value <= high:
            raise ConfigError(f"{what} is {value}; it must be {low:g} to {high:g} {unit}".rstrip())
