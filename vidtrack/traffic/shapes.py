"""Names, points, lines and polygons as they may be in a site."""

from __future__ import annotations

import re
from itertools import pairwise
from typing import Annotated

import numpy as np
from pydantic import AfterValidator, Field

from vidtrack.traffic.lengths import bounds
from vidtrack.traffic.polyline import crosses_itself

_NAME = re.compile(r"[^\W_][\w .-]{0,63}(?<! )")


def _plain(name: str) -> str:
    """Names go into tables that spreadsheets and browsers open: nothing in them may be a formula, a cell or a tag."""
    if not _NAME.fullmatch(name):
        raise ValueError(
            "a name begins with a letter or a digit; letters, digits, spaces and . _ - may follow, up to 64 characters"
        )
    return name


Name = Annotated[str, AfterValidator(_plain)]
Point = tuple[float, float]
Positive = Annotated[float, Field(gt=0)]
Segment = tuple[Point, Point]
Bounds = Annotated[tuple[float, float], AfterValidator(bounds)]


def _distinct(points: tuple[Point, ...]) -> tuple[Point, ...]:
    for first, second in pairwise(points):
        if first == second:
            raise ValueError(f"the point {written(first)} stands twice in a row")
    return points


def _path(points: tuple[Point, ...]) -> tuple[Point, ...]:
    if len(points) < 2:
        raise ValueError("a line needs at least 2 points")
    if crosses_itself(np.array(_distinct(points)), closed=False):
        raise ValueError("the line crosses itself; its sides would have no meaning")
    return points


def _outline(points: tuple[Point, ...]) -> tuple[Point, ...]:
    points = points[:-1] if points[:1] == points[-1:] else points
    if len(points) < 3:
        raise ValueError("a polygon needs at least 3 corners")
    if crosses_itself(np.array(_distinct(points)), closed=True):
        raise ValueError("the polygon crosses itself; list its corners in order around it")
    return points


Line = Annotated[tuple[Point, ...], AfterValidator(_path)]
Polygon = Annotated[tuple[Point, ...], AfterValidator(_outline)]


def written(point: Point) -> str:
    """A point in a message."""
    return f"({point[0]:g}, {point[1]:g})"
