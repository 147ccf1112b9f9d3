"""The plane of the tracks on the earth: metres east and north of a point in WGS84."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from pyproj import Transformer

from vidtrack.arrays.types import Floats


@dataclass(frozen=True)
class Plane:
    """The azimuthal equidistant projection: distance and azimuth from its origin are those on the ellipsoid.

    latitude, longitude   degrees; of the origin x = y = 0
    height                m; above the ellipsoid
    """

    latitude: float
    longitude: float
    height: float = 0.0

    @cached_property
    def _projection(self) -> Transformer:
        return Transformer.from_crs(
            "EPSG:4326",
            f"+proj=aeqd +lat_0={self.latitude!r} +lon_0={self.longitude!r} +datum=WGS84 +units=m",
            always_xy=True,
        )

    def metres(self, latitude: Floats, longitude: Floats) -> Floats:
        """(N, 2) east, north [m] of points (N,), (N,) [degrees]."""
        return np.column_stack(self._projection.transform(longitude, latitude))

    def degrees(self, xy: Floats) -> tuple[Floats, Floats]:
        """Latitudes and longitudes (N,) of points (N, 2) [m]."""
        longitude, latitude = self._projection.transform(xy[:, 0], xy[:, 1], direction="INVERSE")
        return np.asarray(latitude), np.asarray(longitude)


def plane_of_run(summary: Mapping[str, Any]) -> Plane | None:
    """The plane of a run by its summary.json: its `origin`, else the setting radar.geodetic. None: it is not known."""
    origin = summary.get("origin") or summary.get("settings", {}).get("radar", {}).get("geodetic")
    return Plane(*origin) if origin else None
