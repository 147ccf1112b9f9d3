"""Coordinate systems of ground points, by their EPSG numbers."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    import pyproj

_TRUE = 0.005
"""Largest share by which lengths may differ from those on the ground: a country that uses one UTM zone stays below."""
_OWN_M = 10e3
"""m; own metres are counted from a point that is no farther away"""
_RIM = 0.05
"""Share of a region on each side where the zero point of a system is no place to measure from."""
_WORLD_DEG = 180.0
"""Degrees of longitude; of a region as wide, the zero point lies in an ocean"""


@cache
def metric_system(epsg: int) -> pyproj.CRS:
    """The system of this number. Raises ValueError where there is none, or it is not metres on a plane."""
    import pyproj  # takes 0.1 s

    try:
        system = pyproj.CRS.from_epsg(epsg)
    except pyproj.exceptions.CRSError:
        raise ValueError("no such coordinate system") from None
    if not system.is_projected or system.axis_info[0].unit_name != "metre":
        raise ValueError(
            f"the system {system.name} does not measure in metres on a plane; take a projected system of the region "
            "that does, for example 25832, and bring ground into it"
        )
    axes = {axis.direction for axis in system.axis_info[:2]}
    if axes != {"east", "north"}:
        raise ValueError(
            f"the axes of {system.name} point {' and '.join(sorted(axes))}; take a system of the region whose axes "
            "point east and north, for example its UTM zone, and bring ground into it"
        )
    return system


def refuse_untrue(epsg: int, ground: Sequence[tuple[float, float]], *, geographic: bool) -> None:
    """Raise ValueError where lengths in a metric system are not those on the ground, as in web Mercator.

    Metres from a point of one's own are refused first, as far as they are told.

    ground  (x, y) in the system [m], or, if geographic, (longitude, latitude) [degrees]
    """
    import pyproj

    system = metric_system(epsg)
    projection = pyproj.Proj(system)
    x, y = np.array(ground, float).T
    lon, lat = (x, y) if geographic else projection(x, y, inverse=True)
    if (
        not geographic
        and np.abs(ground).max() < _OWN_M
        and not _inland(system, float(np.mean(lon)), float(np.mean(lat)))
    ):
        raise ValueError(
            f"ground looks like metres from a point of your own, which have no epsg: leave epsg = {epsg} out. Within "
            f"{_OWN_M / 1000:g} km of its zero point {system.name} has no roads"
        )
    factors = projection.get_factors(lon, lat)
    scales = np.stack([factors.meridional_scale, factors.parallel_scale])
    if not np.isfinite(scales).all():
        raise ValueError(f"ground lies outside the region of epsg = {epsg}")
    off = np.abs(scales - 1)
    if off.max() <= _TRUE:
        return
    direction, point = np.unravel_index(off.argmax(), off.shape)
    east, north = lon[point], lat[point]
    zone = (326 if north >= 0 else 327) * 100 + int((east + 180) // 6) % 60 + 1
    metres = "" if geographic else ", and bring ground into it; metres from a point of your own have no epsg"
    raise ValueError(
        f"epsg = {epsg}, {system.name}: at longitude {east:.2f} and latitude {north:.2f} its lengths are "
        f"{scales[direction, point]:.3f} times those on the ground; take a system that is true to lengths there, for "
        f"example {zone}, the UTM zone of the place{metres}"
    )


def _inland(system: pyproj.CRS, lon: float, lat: float) -> bool:
    """Whether a place lies well inside the region of a system; true where that is not known."""
    area = system.area_of_use
    if area is None:
        return True
    wide, high = (area.east - area.west) % 360, area.north - area.south
    right, up = (lon - area.west) % 360, lat - area.south
    inside = _RIM * wide < right < (1 - _RIM) * wide and _RIM * high < up < (1 - _RIM) * high
    return inside and 0 < wide < _WORLD_DEG
