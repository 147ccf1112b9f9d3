"""Radars of a network: their places, errors and coverage; `radars.toml`, with a table [radars.NAME] for each."""

from __future__ import annotations

import difflib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import Field, ValidationError
from pydantic import model_validator as whole

from vidtrack.arrays.types import Floats
from vidtrack.config.group import Group, read_toml
from vidtrack.errors import ConfigError

STEP_M = 1000.0
"""m; length over which the direction of north is measured on the plane."""


class Radar(Group):
    """A radar of a network, as its table in radars.toml says."""

    latitude: float | None = Field(None, ge=-90, le=90)
    """degrees, WGS84"""
    longitude: float | None = Field(None, ge=-180, le=180)
    """degrees, WGS84"""
    height_m: float = 0.0
    """m above the ellipsoid, or above the plane of x_m and y_m"""
    x_m: float | None = None
    """m east, in place of latitude and longitude"""
    y_m: float | None = None
    """m north"""
    boresight_deg: float = Field(0.0, ge=-360, le=360)
    """degrees clockwise from north; direction in which the radar measures azimuth zero"""
    sigma_range_m: float | None = Field(None, gt=0)
    """m; standard deviation of a range; None: from the plots, else radar.sigma_range_m"""
    sigma_azimuth_deg: float | None = Field(None, gt=0, le=45)
    """degrees; the same of an azimuth"""
    sigma_doppler_m_s: float | None = Field(None, gt=0)
    """m/s; the same of a range rate"""
    scan_s: float | None = Field(None, gt=0)
    """s; time of a turn of the antenna; None: from the plots"""
    farthest_m: float | None = Field(None, gt=0)
    """m; range beyond which nothing is detected; None: the farthest plot"""
    sector_deg: float = Field(360.0, gt=0, le=360)
    """degrees; width of the sector about azimuth zero that the radar covers"""
    slowest_m_s: float = Field(0.0, ge=0)
    """m/s; range rate below which targets are not told from the ground; P_D is half there"""
    detection_probability: float | None = Field(None, gt=0, lt=1)
    """probability that a scan detects a target in range; None: radar.detection_probability"""
    bias_range_m: float | None = Field(None, ge=0)
    """m; standard deviation of the unknown bias in range; 0: there is none; None: by how far the radar sees"""
    bias_azimuth_deg: float = Field(1.0, ge=0, le=45)
    """degrees; the same in azimuth"""
    bias_time_s: float = Field(0.0, ge=0)
    """s; the same of the clock; the first radar's clock counts as right"""
    sac: int | None = Field(None, ge=0, le=255)
    """system area code of its ASTERIX records, by which they are told from those of others"""
    sic: int | None = Field(None, ge=0, le=255)
    """system identification code of its ASTERIX records"""

    @whole(mode="after")
    def _one_place(self) -> Radar:
        on_earth, on_plane = (self.latitude, self.longitude), (self.x_m, self.y_m)
        for pair, names in ((on_earth, "latitude and longitude"), (on_plane, "x_m and y_m")):
            if (pair[0] is None) != (pair[1] is None):
                raise ValueError(f"{names} belong together; give both")
        if (self.latitude is None) == (self.x_m is None):
            raise ValueError("a radar needs a place: latitude and longitude, or x_m and y_m")
        if (self.sac is None) != (self.sic is None):
            raise ValueError("sac and sic belong together; give both")
        return self


@dataclass(frozen=True, slots=True)
class Placed:
    """A radar on the common plane, x east, y north.

    name, radar
    xyz     m; its place
    turned  rad; what is added to its azimuths: its boresight, and the angle from north at the plane's origin to north
            where it stands
    """

    name: str
    radar: Radar
    xyz: tuple[float, float, float]
    turned: float


@dataclass(frozen=True, slots=True)
class Radars:
    """The radars of a file in its order.

    placed  each radar on the common plane
    origin  latitude, longitude [degrees] and height [m], 0, of the plane's origin, the mean of the radars' places;
            None: the file gives places in metres
    """

    path: Path
    placed: tuple[Placed, ...]
    origin: tuple[float, float, float] | None

    @property
    def names(self) -> list[str]:
        """Names of the radars."""
        return [one.name for one in self.placed]

    @property
    def codes(self) -> list[tuple[int, int]]:
        """SAC and SIC of the radars that have them."""
        own = [(one.radar.sac, one.radar.sic) for one in self.placed]
        return [(sac, sic) for sac, sic in own if sac is not None and sic is not None]

    def named(self, name: str) -> Placed:
        """The radar of this name. Raises ConfigError, with the nearest name."""
        for one in self.placed:
            if one.name == name:
                return one
        near = difflib.get_close_matches(name, self.names, n=1, cutoff=0.5)
        hint = f"did you mean {near[0]!r}?" if near else f"it has {', '.join(self.names)}"
        raise ConfigError(f"{self.path} has no radar {name!r}; {hint}")

    def coded(self, sac: int, sic: int) -> Placed:
        """The radar of these codes. Raises ConfigError."""
        for one in self.placed:
            if (one.radar.sac, one.radar.sic) == (sac, sic):
                return one
        raise ConfigError(f"{self.path} has no radar with sac = {sac} and sic = {sic}; add them to its table")


class _File(Group):
    """The content of radars.toml."""

    radars: dict[str, Radar]


def read_radars(path: str | Path) -> Radars:
    """Read radars.toml. Raises ConfigError for a file that cannot be read, unknown keys and bad values."""
    path = Path(path)
    tree = read_toml(path, "the radars' file")
    try:
        radars = _File.model_validate(tree).radars
    except ValidationError as error:
        raise ConfigError("\n".join(_complaint(path, detail) for detail in error.errors())) from None
    if not radars:
        raise ConfigError(f"{path} has no radar; it needs a table [radars.NAME] for each")
    on_earth = [radar.latitude is not None for radar in radars.values()]
    if any(on_earth) and not all(on_earth):
        raise ConfigError(
            f"{path}: {list(radars)[on_earth.index(False)]} has x_m and y_m, others have latitude and longitude; "
            "give all radars the same"
        )
    _refuse_shared_codes(path, radars)
    return _on_earth(path, radars) if on_earth[0] else _on_plane(path, radars)


def _on_plane(path: Path, radars: dict[str, Radar]) -> Radars:
    placed = [
        Placed(name, radar, (radar.x_m or 0.0, radar.y_m or 0.0, radar.height_m), np.radians(radar.boresight_deg))
        for name, radar in radars.items()
    ]
    return Radars(path, tuple(placed), None)


def _on_earth(path: Path, radars: dict[str, Radar]) -> Radars:
    """Places by the azimuthal equidistant projection about the mean place.

    Distances from the origin are true. Others are too long by up to 1 in 6 (distance / radius of the earth)^2: 16 m in
    100 km at a distance of 200 km.
    """
    import pyproj

    latitude = np.array([radar.latitude for radar in radars.values()], float)
    longitude = np.array([radar.longitude for radar in radars.values()], float)
    around = np.radians(longitude)
    mean = np.degrees(np.arctan2(np.sin(around).mean(), np.cos(around).mean()))
    origin = float(latitude.mean()), float(mean), 0.0
    plane = pyproj.Proj(proj="aeqd", lat_0=origin[0], lon_0=origin[1], ellps="WGS84")
    geod = pyproj.Geod(ellps="WGS84")
    placed = []
    for (name, radar), lat, lon in zip(radars.items(), latitude, longitude, strict=True):
        here: Floats = np.array(plane(lon, lat))
        north = np.array(plane(*geod.fwd(lon, lat, 0.0, STEP_M)[:2])) - here
        turned = np.arctan2(north[0], north[1]) + np.radians(radar.boresight_deg)
        placed.append(Placed(name, radar, (float(here[0]), float(here[1]), radar.height_m), float(turned)))
    return Radars(path, tuple(placed), origin)


def _refuse_shared_codes(path: Path, radars: dict[str, Radar]) -> None:
    owner: dict[tuple[int | None, int | None], str] = {}
    for name, radar in radars.items():
        codes = radar.sac, radar.sic
        if codes in owner and radar.sac is not None:
            raise ConfigError(f"{path}: {owner[codes]} and {name} have the same sac and sic; each radar has its own")
        owner[codes] = name


def _complaint(path: Path, detail: Any) -> str:
    """One line per error: the key, its value, and what is allowed."""
    where = [str(part) for part in detail["loc"]]
    name = ".".join(where)
    if detail["type"] == "extra_forbidden":
        known = Radar.model_fields if len(where) == 3 else ["radars"]
        near = difflib.get_close_matches(where[-1], known, n=1, cutoff=0.5)
        return f"{path}: unknown key {name}; " + (f"did you mean {near[0]}?" if near else f"known: {', '.join(known)}")
    if detail["type"] == "missing":
        return f"{path} has no radar; it needs a table [radars.NAME] for each"
    message = detail["msg"].removeprefix("Value error, ")
    value = "" if isinstance(detail["input"], dict) else f" = {detail['input']!r}"
    return f"{path}: {name}{value}: {message[0].lower()}{message[1:]}"
