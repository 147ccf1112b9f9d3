"""The plan or aerial picture beside the camera's picture, and where its pixels are in metres: its world file.

A world file has six lines A, D, B, E, C, F; the middle of the pixel in column x and row y is at (A x + B y + C,
D x + E y + F), x east and y north (ESRI).
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from vidtrack.errors import ConfigError
from vidtrack.output.folder import replacing

World = tuple[float, ...]
"""The six numbers, in the order of the file."""


def world_file(plan: Path) -> Path:
    """The place of a picture's world file: plan.png has plan.pgw."""
    kind = plan.suffix[1:]
    return plan.with_suffix(f".{kind[0]}{kind[-1]}w" if len(kind) >= 2 else ".wld")


def read_world(plan: Path) -> World | None:
    """The numbers of a picture's world file, None without one. Raises ConfigError for a file that is none."""
    path = next((path for path in (world_file(plan), plan.with_suffix(".wld")) if path.is_file()), None)
    if path is None:
        return None
    try:
        world = tuple(float(number) for number in path.read_text(encoding="ascii").split())
    except (ValueError, OSError):
        world = ()
    if not is_world(world):
        raise ConfigError(f"{path} is no world file: it needs six numbers A, D, B, E, C, F that span a plane")
    return world


def write_world(plan: Path, world: World) -> None:
    """Write a picture's world file. Raises StoppedEarly."""
    with replacing(world_file(plan)) as new:
        new.write_text("".join(f"{number!r}\n" for number in world), encoding="ascii")


def is_world(world: World) -> bool:
    """Whether these numbers map pixels to a plane."""
    return len(world) == 6 and bool(np.isfinite(world).all()) and world[0] * world[3] != world[1] * world[2]
