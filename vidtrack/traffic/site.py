"""A site: where the gates, the zones and the road are in the picture of one camera; one file, `site.toml`."""

from __future__ import annotations

import difflib
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import (
    AfterValidator,
    AwareDatetime,
    BaseModel,
    Field,
    PrivateAttr,
    ValidationError,
    ValidationInfo,
    field_validator,
)
from pydantic import model_validator as whole

from vidtrack.config.group import Group, parse_toml, read_toml_text
from vidtrack.errors import ConfigError
from vidtrack.traffic.epsg import metric_system, refuse_untrue
from vidtrack.traffic.lengths import apart
from vidtrack.traffic.shapes import Bounds, Line, Name, Point, Polygon, Positive, Segment, written

LEAST_FOR_LENS = 6
"""Pairs of points that a lens can be fitted to, with something left to check it with."""
_FARTHEST_M = 1e8
_ASPECT_PX = 1.0  # what rounding to whole pixels may do to a picture's height


def _metric(epsg: int) -> int:
    metric_system(epsg)
    return epsg


class Camera(Group):
    """The picture, and the time of its first one."""

    name: Name
    """of the site"""
    width: int = Field(gt=0)
    """px; of the picture that all coordinates refer to"""
    height: int = Field(gt=0)
    """px"""
    start: AwareDatetime | None = None
    """time of the video's first picture, with its zone"""


class Calibration(Group):
    """Where points of the road are in the picture.

    Either `picture` with `ground`, or, without a map, `lengths` with `directions` (and `across`).
    """

    picture: tuple[Point, ...] = ()
    """px; points of the road in the picture, at least 4"""
    ground: tuple[Point, ...] = ()
    """m, x east and y north; the same points on the road; with `geographic`, longitude and latitude in degrees"""
    sigma_picture_px: float = Field(1.0, gt=0)
    """px; standard deviation of a picture point, per axis"""
    sigma_ground_m: float = Field(0.02, ge=0)
    """m; standard deviation of a ground point, per axis, or of a known length"""
    camera_height_m: float | None = Field(None, gt=0)
    """m above the road, to compare with what the points say; None: not known"""
    geographic: bool = False
    """`ground` holds longitudes and latitudes"""
    epsg: Annotated[int, Field(gt=0), AfterValidator(_metric)] | None = None
    """metric coordinate system of `ground`, or the one that longitudes and latitudes are brought into"""
    distortion: tuple[float, float] | Literal["fit"] | None = None
    """k1, k2 of the lens (Brown-Conrady, on normalised coordinates); "fit": k1 from the points; None: straight lines
    are straight"""
    focal_px: float | None = Field(None, gt=0)
    """px; focal length; None: from the points, with square pixels"""
    center: Point | None = None
    """px; where the optical axis meets the picture; None: its middle"""
    lengths: tuple[tuple[Point, Point, Positive], ...] = ()
    """px, px, m; segments on the road with their lengths"""
    directions: tuple[Segment, ...] = ()
    """px; segments along a straight road, at least 2"""
    across: tuple[Segment, ...] = ()
    """px; segments square to them, at least 2 where the focal length is not given"""

    @field_validator("distortion", mode="before")
    @classmethod
    def _two_numbers(cls, value: object) -> object:
        numbers = list(value) if isinstance(value, (list, tuple)) else []
        two = len(numbers) == 2 and all(isinstance(k, (int, float)) and not isinstance(k, bool) for k in numbers)
        if not (two or value is None or value == "fit"):
            raise ValueError('give [k1, k2], or "fit" for k1 by the points')
        return value

    @whole(mode="after")
    def _one_kind(self) -> Calibration:
        plan = bool(self.picture or self.ground)
        if plan == bool(self.lengths or self.directions or self.across):
            raise ValueError("give picture and ground, or lengths and directions, and not both")
        if plan:
            self._check_points()
        elif len(self.directions) < 2 or not self.lengths:
            raise ValueError("without ground points at least 2 directions and 1 length are needed")
        elif len(self.across) < 2 and (self.across or self.focal_px is None):
            raise ValueError("give at least 2 segments across, or none and focal_px")
        ends = [(name, *segment) for name in ("directions", "across") for segment in getattr(self, name)]
        ends += [("lengths", first, second) for first, second, _ in self.lengths]
        if dots := [name for name, first, second in ends if first == second]:
            raise ValueError(f"a segment of {dots[0]} begins and ends in one point")
        if self.distortion == "fit" and len(self.picture) < LEAST_FOR_LENS:
            raise ValueError(f'distortion = "fit" needs at least {LEAST_FOR_LENS} pairs of points')
        if isinstance(self.distortion, tuple) and self.focal_px is None:
            raise ValueError("distortion is on normalised coordinates and needs focal_px")
        return self

    def _check_points(self) -> None:
        if len(self.picture) != len(self.ground):
            raise ValueError(f"{len(self.picture)} points in picture, {len(self.ground)} in ground; they are pairs")
        if len(self.picture) < 4:
            raise ValueError(f"{len(self.picture)} pairs of points; a plane needs at least 4")
        for name, points in (("picture", self.picture), ("ground", self.ground)):
            if len(set(points)) < len(points):
                twice = next(point for point in points if points.count(point) > 1)
                raise ValueError(f"the point {written(twice)} stands twice in {name}")
        if far := [point for point in self.ground if max(map(abs, point)) > _FARTHEST_M]:
            raise ValueError(f"the point {written(far[0])} in ground is farther away than any place on Earth")
        if self.geographic and self.epsg is None:
            raise ValueError("geographic needs epsg, the metric system to measure in, for example 25832")
        if self.geographic and not all(abs(lon) <= 180 and abs(lat) <= 90 for lon, lat in self.ground):
            raise ValueError("with geographic, ground is longitude (-180 to 180) and latitude (-90 to 90) in degrees")
        if self.epsg is not None:
            refuse_untrue(self.epsg, self.ground, geographic=self.geographic)

    def points(self) -> Iterator[tuple[str, Point]]:
        """Every picture point with the key that it stands under."""
        yield from (("picture", point) for point in self.picture)
        yield from (("lengths", point) for first, second, _ in self.lengths for point in (first, second))
        for name in ("directions", "across"):
            yield from ((name, point) for segment in getattr(self, name) for point in segment)


class Gate(Group):
    """A line that vehicles are counted over."""

    line: Line
    """px; the corners of the line"""
    leg: Name | None = None
    """arm of the junction that the gate lies on"""
    role: Literal["entry", "exit", "both", "neutral"] = "neutral"
    """whether vehicles enter the site there, leave it, both, or neither"""


class Zone(Group):
    """A part of the road."""

    polygon: Polygon
    """px; its corners in order"""
    tracked: bool = True
    """false: a mask, inside which nothing is tracked"""


class Section(Group):
    """The way from one gate to another, with its length: speeds without a calibration."""

    from_gate: str = Field(alias="from")
    """gate where it begins"""
    to_gate: str = Field(alias="to")
    """gate where it ends"""
    length_m: float = Field(gt=0)
    """m"""


class Movements(Group):
    """Which movements there are."""

    allowed: tuple[tuple[str, str], ...] = ()
    """legs from which and to which vehicles may go"""


class Report(Group):
    """How figures are summed up."""

    interval_s: float = Field(900.0, ge=1, le=86_400)
    """s, from a second to a day"""


class Site(Group):
    """Everything that is known of a site. Frozen; all picture coordinates refer to `camera.width` x `camera.height`."""

    camera: Camera = Field(alias="site")
    calibration: Calibration | None = None
    gates: dict[Name, Gate] = Field({})
    zones: dict[Name, Zone] = Field({})
    sections: dict[Name, Section] = Field({})
    movements: Movements = Movements()
    classes: Annotated[dict[Name, Bounds], AfterValidator(apart)] = Field({})
    report: Report = Report()
    _file: Path | None = PrivateAttr(None)

    @property
    def legs(self) -> tuple[str, ...]:
        """The legs in order of their gates; a gate without one is a leg by itself."""
        return tuple(dict.fromkeys(gate.leg or name for name, gate in self.gates.items()))

    def legs_with(self, role: Literal["entry", "exit"]) -> tuple[str, ...]:
        """The legs that have a gate of this role, or one of both roles, in the same order."""
        gates = [(gate.leg or name, gate.role) for name, gate in self.gates.items()]
        return tuple(leg for leg in self.legs if not {(leg, role), (leg, "both")}.isdisjoint(gates))

    @property
    def center(self) -> Point:
        """Where the optical axis meets the picture [px]."""
        given = None if self.calibration is None else self.calibration.center
        return given or ((self.camera.width - 1) / 2, (self.camera.height - 1) / 2)

    @field_validator("gates", "zones", "calibration")
    @classmethod
    def _inside(cls, parts: Any, given: ValidationInfo) -> Any:
        camera = given.data.get("camera")
        if parts is None or camera is None:
            return parts
        for name, (x, y) in _picture_points(parts):
            if not (-0.5 <= x <= camera.width and -0.5 <= y <= camera.height):
                size = f"{camera.width} x {camera.height}"
                raise ValueError(f"the point {written((x, y))} of {name} lies outside the {size} picture")
        return parts

    @whole(mode="after")
    def _known_names(self) -> Site:
        for name, section in self.sections.items():
            for key, gate in (("from", section.from_gate), ("to", section.to_gate)):
                if gate not in self.gates:
                    raise ValueError(f"sections.{name}.{key} = {gate!r}: no such gate{_near(gate, self.gates)}")
            if section.from_gate == section.to_gate:
                raise ValueError(f"sections.{name} begins and ends at the gate {section.to_gate!r}; name two gates")
        for movement in self.movements.allowed:
            for leg in movement:
                if leg not in self.legs:
                    raise ValueError(f"movements.allowed: no gate is on a leg {leg!r}{_near(leg, self.legs)}")
        return self

    @property
    def tracked_zones(self) -> dict[str, Zone]:
        """The zones in which vehicles are tracked."""
        return {name: zone for name, zone in self.zones.items() if zone.tracked}

    @property
    def masked(self) -> tuple[tuple[Point, ...], ...]:
        """The zones in which nothing is tracked."""
        return tuple(zone.polygon for zone in self.zones.values() if not zone.tracked)

    def scaled(self, width: int, height: int) -> Site:
        """The site for another size of the same picture. Raises ConfigError where the aspect is another."""
        was = self.camera
        if (width, height) == (was.width, was.height):
            return self
        if abs(width * was.height / was.width - height) > _ASPECT_PX:
            with self.named():
                raise ConfigError(
                    f"the site {was.name} is drawn on a {was.width} x {was.height} picture, and this one is "
                    f"{width} x {height}: not the same shape, so the place of the site in it is not known"
                )
        fx, fy = width / was.width, height / was.height
        tree = _moved(self, lambda point: (fx * (point[0] + 0.5) - 0.5, fy * (point[1] + 0.5) - 0.5))
        tree["site"] |= {"width": width, "height": height}
        if self.calibration is not None:
            for name in ("sigma_picture_px", "focal_px"):
                value = getattr(self.calibration, name)
                tree["calibration"][name] = None if value is None else fx * value
        return Site.model_validate(tree)._of(self._file)

    @contextmanager
    def named(self) -> Iterator[None]:
        """A ConfigError about the site, raised inside, names the file that the site was read from."""
        try:
            yield
        except ConfigError as error:
            raise error if self._file is None else ConfigError(f"{self._file}: {error}") from None

    def _of(self, file: Path | None) -> Site:
        self._file = file
        return self


_SECTIONS: dict[str, type[BaseModel]] = {
    "site": Camera,
    "calibration": Calibration,
    "movements": Movements,
    "report": Report,
}
_PARTS: dict[str, type[BaseModel]] = {"gates": Gate, "zones": Zone, "sections": Section}


def read_site(path: str | Path) -> Site:
    """The site in a TOML file.

    Raises ConfigError for an unreadable file, an unknown key (naming the nearest), or a value that cannot be meant:
    points outside the picture, a coordinate system that is not metric or not true to lengths there, lines and polygons
    that cross themselves, unknown gates and legs, names that a spreadsheet or browser could take for more than a name.
    """
    path = Path(path)
    return parse_site(read_toml_text(path, "site"), path)


def parse_site(text: str, path: Path) -> Site:
    """The site in a file with this text. Raises ConfigError as `read_site` does."""
    tree = parse_toml(text, path)
    try:
        return Site.model_validate(tree)._of(path)
    except ValidationError as error:
        raise ConfigError("\n".join(f"{path}: {fault.words}" for fault in faults_of(error))) from None


@dataclass(frozen=True, slots=True)
class Fault:
    """A mistake in a site: the key that it is at, which is empty for what several parts do not agree on, and words."""

    key: tuple[str, ...]
    words: str


def faults_of(error: ValidationError) -> list[Fault]:
    """The mistakes in a tree that is no site."""
    return [Fault(_key(detail), _complaint(detail)) for detail in error.errors()]


def _picture_points(parts: dict[str, Gate | Zone] | Calibration) -> Iterator[tuple[str, Point]]:
    """Every picture point of gates, zones or the calibration, and whose it is."""
    if isinstance(parts, Calibration):
        yield from parts.points()
        return
    for name, part in parts.items():
        yield from ((name, point) for point in (part.line if isinstance(part, Gate) else part.polygon))


def _moved(site: Site, move: Callable[[Point], Point]) -> dict[str, Any]:
    """The site as a tree, with every picture point moved."""
    tree = site.model_dump(by_alias=True)
    for gate in tree["gates"].values():
        gate["line"] = [move(point) for point in gate["line"]]
    for zone in tree["zones"].values():
        zone["polygon"] = [move(point) for point in zone["polygon"]]
    calibration = tree["calibration"]
    if calibration is not None:
        calibration["picture"] = [move(point) for point in calibration["picture"]]
        calibration["lengths"] = [(move(first), move(second), m) for first, second, m in calibration["lengths"]]
        for name in ("directions", "across"):
            calibration[name] = [[move(point) for point in segment] for segment in calibration[name]]
        if calibration["center"] is not None:
            calibration["center"] = move(calibration["center"])
    return tree


def _complaint(detail: Any) -> str:
    """One line for one mistake: the key, what was given, what is allowed."""
    path = _key(detail)
    key = ".".join(path)
    if detail["type"] == "extra_forbidden":
        return f"unknown key {key}{_near(path[-1], _keys(path[:-1]))}"
    if detail["type"] == "missing":
        return f"{key} is missing"
    message = detail["msg"].removeprefix("Value error, ")
    if key in ("", "calibration", "gates", "zones", "classes"):  # a whole section: the message names the place
        return f"[{key}]: {message}" if key else message
    if key == "site.start":
        return f"{key} = {detail['input']}: write date, time and zone, for example 2026-06-01T07:00:00+02:00"
    return f"{key} = {detail['input']!r}: {message[0].lower()}{message[1:]}"


def _key(detail: Any) -> tuple[str, ...]:
    return tuple(str(part) for part in detail["loc"] if part != "[key]")


def _keys(path: tuple[str, ...]) -> list[str]:
    """The keys that may stand at a place of the file."""
    group: type[BaseModel] = Site
    if path[1:]:
        group = _PARTS[path[0]]
    elif path:
        group = _SECTIONS[path[0]]
    return [info.alias or name for name, info in group.model_fields.items()]


def _near(name: str, known: Iterable[str]) -> str:
    """The nearest of the known names, and all of them where none is near."""
    names = list(known)
    near = difflib.get_close_matches(name, names, n=1, cutoff=0.5)
    if near:
        return f"; did you mean {near[0]}?"
    return f"; there {'are' if len(names) > 1 else 'is'} {', '.join(names)}" if names else "; there is none"
