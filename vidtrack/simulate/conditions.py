"""Weather and light: which there are, which go together, and what they add to a picture."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from vidtrack.errors import ConfigError
from vidtrack.simulate import light, weather, wet
from vidtrack.simulate.moment import Canvas, Moment
from vidtrack.simulate.scene import Path, Scene

WEATHER = ("clear", "rain", "snow", "fog")
LIGHT = ("day", "low-sun", "dusk", "night")
MOST_LEAVES = 10.0

Effect = Callable[[Canvas, Moment], Canvas]


@dataclass(frozen=True, slots=True)
class Conditions:
    """What the scene is seen in; the defaults change nothing.

    weather  of WEATHER; rain wets the road, and anything but clear hides the sun
    light    of LIGHT
    wet      a wet road under a clear sky
    leaves   how far leaves swing, a factor
    clock    a date and time burnt into the picture
    """

    weather: str = "clear"
    light: str = "day"
    wet: bool = False
    leaves: float = 1.0
    clock: bool = False

    def check(self, trees: bool) -> None:
        """For a scene with or without trees. Raises ConfigError for an unknown or needless condition."""
        for name, value, known in (("weather", self.weather, WEATHER), ("light", self.light, LIGHT)):
            if value not in known:
                raise ConfigError(f"{name} is {value!r}; it must be one of {', '.join(known)}")
        if not 0 <= self.leaves <= MOST_LEAVES:
            raise ConfigError(f"leaves is {self.leaves}; it must be 0 to {MOST_LEAVES:g}")
        if self.leaves != 1 and not trees:
            raise ConfigError("leaves does nothing in a scene without trees; leave it out")
        if self.wet and self.weather == "rain":
            raise ConfigError("rain wets the road; leave wet out")
        if self.light == "low-sun" and self.weather != "clear":
            raise ConfigError(f"{self.weather} hides the sun; low-sun needs clear weather")

    def on(self, scene: Scene, seed: int) -> Scene:
        """The scene with its sun and its trees as they are in these conditions."""
        if self.light == "low-sun":
            scene = replace(scene, sun=light.low_sun(np.random.default_rng((seed, 3))))
        elif self.light != "day" or self.weather != "clear":
            scene = replace(scene, sun=None)
        if self.leaves != 1:
            swung = []
            for prop in scene.props:
                middle = prop.path.xy.mean(axis=0)
                path = Path(prop.path.t, middle + self.leaves * (prop.path.xy - middle), prop.path.heading)
                swung.append(replace(prop, path=path))
            scene = replace(scene, props=tuple(swung))
        return scene

    def below(self) -> list[Effect]:
        """What changes the street before anybody is drawn on it."""
        return [wet.Shine()] if self.shining else []

    @property
    def shining(self) -> bool:
        """The road is wet."""
        return self.wet or self.weather == "rain"

    @property
    def dark(self) -> bool:
        """Lamps are on."""
        return self.light in ("dusk", "night")

    def above(self, scene: Scene, size: tuple[int, int], scale: float, seed: int) -> list[Effect]:
        """What lies over the drawn scene, in this order."""
        effects: list[Effect] = []
        if self.weather == "rain":
            effects.append(wet.Spray((seed, 4)))
        if self.dark:
            share = light.AMBIENT[self.light]
            lamps = self.light == "night"
            effects.append(light.Lamplight(share, size, scale, (seed, 5), street_lamps=lamps, wet=self.shining))
        if self.light == "low-sun":
            assert scene.sun is not None  # set above
            effects.append(light.Glare(scene.sun, size))
        return effects + self.air(size, scale, seed)

    def air(self, size: tuple[int, int], scale: float, seed: int) -> list[Effect]:
        """What falls or hangs in the air, and the noise of little light."""
        falling: dict[str, Effect] = {
            "rain": weather.Rain((seed, 6)),
            "snow": weather.Snow(size, scale, (seed, 6)),
            "fog": weather.Fog(size, scale, (seed, 6)),
        }
        effects = [falling[self.weather]] if self.weather in falling else []
        return [*effects, light.ShotNoise((seed, 7))] if self.dark else effects
