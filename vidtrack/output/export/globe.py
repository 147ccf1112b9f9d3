"""From a site's metres to longitude and latitude."""

from __future__ import annotations

import logging
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from vidtrack.arrays.types import Floats
from vidtrack.errors import ConfigError
from vidtrack.traffic.epsg import metric_system
from vidtrack.traffic.site import Site

if TYPE_CHECKING:
    import pyproj

log = logging.getLogger(__name__)

_NEAR_DEG = 6.0
"""By how much a site may lie beside the longitudes that a system is for: a country uses one zone for all."""


def system_of(site: Site) -> pyproj.CRS | None:
    """The coordinate system of the site's metres; None where they have no place on the map."""
    calibration = site.calibration
    if calibration is None or calibration.epsg is None or not calibration.picture:
        return None
    return metric_system(calibration.epsg)


def to_globe(site: Site, name: str) -> Callable[[Floats], Floats]:
    """A function from metres (N, 2) to longitudes and latitudes (N, 2), in degrees of WGS84.

    name  of the format that needs it, for the message. Raises ConfigError for a site that is not on the map;
    warns where it is far from the region that the system is for.
    """
    import pyproj

    system = system_of(site)
    if system is None:
        raise ConfigError(
            f"{name} needs places on the globe, and the calibration of the site {site.camera.name} has none: give it "
            "ground points in a metric coordinate system with its number, for example epsg = 25832"
        )
    transformer = pyproj.Transformer.from_crs(system, 4326, always_xy=True)
    calibration, area = site.calibration, system.area_of_use
    if calibration is not None and not calibration.geographic and area is not None:
        east, north = transformer.transform(*np.mean(calibration.ground, axis=0))
        if not (area.west - _NEAR_DEG < east < area.east + _NEAR_DEG and area.south <= north <= area.north):
            log.warning(
                "calibration.ground is at longitude %.2f and latitude %.2f by calibration.epsg = %d, which is for "
                "longitudes %g to %g and latitudes %g to %g: are its metres counted from a point of your own?",
                east, north, calibration.epsg, area.west, area.east, area.south, area.north,
            )  # fmt: skip

    def degrees(xy: Floats) -> Floats:
        return np.column_stack(transformer.transform(xy[:, 0], xy[:, 1]))

    return degrees
