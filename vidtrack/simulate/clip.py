"""A simulated clip: frames drawn when asked for, truth known beforehand."""

from __future__ import annotations

import difflib
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from datetime import timedelta
from functools import cached_property

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from vidtrack.arrays.types import Floats
from vidtrack.errors import ConfigError
from vidtrack.simulate import draw
from vidtrack.simulate.camera import Camera, camera
from vidtrack.simulate.clock import beginning, burn_in
from vidtrack.simulate.conditions import Conditions, Effect
from vidtrack.simulate.crossing import crossing, crossing_45
from vidtrack.simulate.junction import junction
from vidtrack.simulate.light import LOW_SUN_SHADOW
from vidtrack.simulate.moment import Moment, Placed
from vidtrack.simulate.nine import nine
from vidtrack.simulate.scene import Actor, Scene
from vidtrack.simulate.truth import Truth, in_front, truth

SCENARIOS: dict[str, Callable[[Generator], Scene]] = {
    "crossing": crossing,
    "crossing-45": crossing_45,
    "nine": nine,
    "junction": junction,
}


class Frames(ABC):
    """What a camera sees. Iterating gives the frames, (H, W, 3) uint8 BGR, each drawn when asked for."""

    camera: Camera
    times: Floats

    def __len__(self) -> int:
        return len(self.times)

    def __iter__(self) -> Iterator[NDArray[np.uint8]]:
        return (self.frame(k) for k in range(len(self)))

    @property
    def size(self) -> tuple[int, int]:
        """(width, height) px."""
        return self.camera.size

    @abstractmethod
    def frame(self, k: int) -> NDArray[np.uint8]:
        """Frame k, (H, W, 3) BGR."""


@dataclass(frozen=True, eq=False)
class Clip(Frames):
    """A scene seen by a camera.

    fps         frames/s
    times       (K,) time of each frame [s]
    seed        of the textures, which are drawn at the camera's scale
    conditions  weather and light
    """

    scene: Scene
    camera: Camera
    fps: float
    times: Floats
    seed: int
    conditions: Conditions = field(default_factory=Conditions)

    @cached_property
    def truth(self) -> Truth:
        """Boxes, visibilities and centres of all targets in all frames."""
        return truth(self.scene, self.times, self.camera.scale, self.camera.shake)

    def frame(self, k: int) -> NDArray[np.uint8]:
        """Frame k, (H, W, 3) BGR."""
        moment = self._moment(k)
        picture = self.camera.framed(self._ground, k)
        for effect in self.conditions.below():
            picture = effect(picture, moment)
        if self.scene.sun is not None:
            self._cast_shadows(picture, moment, self.scene.sun)
        for placed in moment.placed:
            draw.place(picture, placed.sprite, placed.to_picture, placed.corners)
        for effect in self._above:
            picture = effect(picture, moment)
        picture = self.camera.exposed(picture, k)
        if self.conditions.clock:
            burn_in(picture, beginning(self.seed) + timedelta(seconds=self.times[k]))
        return picture

    def _moment(self, k: int) -> Moment:
        """Where everything is in frame k."""
        time, scale, shake = self.times[k], self.camera.scale, self.camera.shake[k]
        placed = []
        for actor in in_front(self.scene.targets + self.scene.props, time):
            corners = actor.outline(np.array([time]))[0] * scale + shake
            placed.append(Placed(actor, self._sprites[actor], self._to_picture(actor, time, shake), corners))
        return Moment(k, time, float(scale.mean()), shake, tuple(placed))

    def _cast_shadows(self, picture: NDArray[np.uint8], moment: Moment, sun: tuple[float, float]) -> None:
        """Shadows of the targets; a low sun's are harder and darker, and trees have them too."""
        low = self.conditions.light == "low-sun"
        softness, left = (0.5 * moment.scale, LOW_SUN_SHADOW) if low else (moment.scale, draw.SHADOW)
        for actor in self.scene.targets + (self.scene.props if low else ()):
            polygon = draw.shadow(actor, moment.time_s, sun) * self.camera.scale + moment.shake
            draw.shade(picture, polygon, softness, left)

    @cached_property
    def _above(self) -> list[Effect]:
        return self.conditions.above(self.scene, self.size, float(self.camera.scale.mean()), self.seed)

    def _to_picture(self, actor: Actor, time: float, shake: Floats) -> Floats:
        """The affine map (2, 3) from the actor's own frame to the picture."""
        zero, x, y = actor.place(np.array([(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)]), np.array([time]))[0]
        turn = np.stack([x - zero, y - zero], axis=1)
        return np.column_stack([turn * self.camera.scale[:, None], zero * self.camera.scale + shake])

    @cached_property
    def _ground(self) -> NDArray[np.uint8]:
        return draw.ground(self.scene, self.camera, self.camera.margin, np.random.default_rng((self.seed, 1)))

    @cached_property
    def _sprites(self) -> dict[Actor, draw.Sprite]:
        rng = np.random.default_rng((self.seed, 2))
        density = draw.SUPERSAMPLING * float(self.camera.scale.max())
        return {actor: draw.sprite(actor.look, density, rng) for actor in self.scene.targets + self.scene.props}


def simulate(
    name: str,
    *,
    seed: int = 0,
    fps: float | None = None,
    size: tuple[int, int] | None = None,
    noise: float = 2.0,
    shake: float = 0.0,
    light_steps: int = 0,
    weather: str = "clear",
    light: str = "day",
    wet: bool = False,
    leaves: float = 1.0,
    clock: bool = False,
) -> Clip:
    """A clip of the scenario `name`: crossing, crossing-45, nine or junction.

    seed         of everything random; the same seed gives the same frames
    fps          frames/s; None: the scenario's own. Motion per second stays the same
    size         (width, height) px; None: the scenario's own. The scene is scaled, and the truth with it
    noise        sensor noise, standard deviation in grey levels
    shake        of the camera, standard deviation of the displacement in x and in y, px
    light_steps  sudden changes of the exposure
    weather, light, wet, leaves, clock  as in Conditions

    Raises ConfigError for an unknown name or a value out of range.
    """
    _check(name, seed, fps, size, noise, shake, light_steps)
    scene_rng, camera_rng = np.random.default_rng(seed).spawn(2)
    scene = SCENARIOS[name](scene_rng)
    conditions = Conditions(weather, light, wet, leaves, clock)
    conditions.check(trees=bool(scene.props))
    scene = conditions.on(scene, seed)
    times = scene.times(fps)
    view = camera(scene.size, size or scene.size, times, camera_rng, noise=noise, shake=shake, light_steps=light_steps)
    return Clip(scene, view, scene.fps if fps is None else fps, times, seed, conditions)


def _check(
    name: str, seed: int, fps: float | None, size: tuple[int, int] | None, noise: float, shake: float, light_steps: int
) -> None:
    if name not in SCENARIOS:
        near = difflib.get_close_matches(name, SCENARIOS, n=1) or [", ".join(SCENARIOS)]
        raise ConfigError(f"no scenario is called {name!r}; did you mean {near[0]}?")
    check_camera(seed, fps, size, noise, shake, light_steps)


def check_camera(
    seed: int, fps: float | None, size: tuple[int, int] | None, noise: float, shake: float, light_steps: int
) -> None:
    """Raises ConfigError for a value out of range."""
    if seed < 0:
        raise ConfigError(f"seed is {seed}; it must be 0 or more")
    if fps is not None and not 1 <= fps <= 1000:
        raise ConfigError(f"fps is {fps}; it must be 1 to 1000 frames/s")
    if size is not None and not (min(size) >= 32 and max(size) <= 4096):
        raise ConfigError(f"size is {size[0]}x{size[1]}; each side must be 32 to 4096 px")
    for what, value in (("noise", noise), ("shake", shake)):
        if not 0 <= value <= 50:
            raise ConfigError(f"{what} is {value}; it must be 0 to 50")
    if not 0 <= light_steps <= 100:
        raise ConfigError(f"light_steps is {light_steps}; it must be 0 to 100")
