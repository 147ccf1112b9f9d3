"""Coordinate systems of ground points, by their EPSG numbers."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import pyproj


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
    return system
