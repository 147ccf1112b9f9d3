"""Options of all commands that turn pictures into tracks."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import click

from vidtrack.cli.options import association_options

Function = TypeVar("Function", bound=Callable[..., Any])


def _mp4(_context: click.Context, _option: click.Parameter, value: Path | None) -> Path | None:
    """Check the value of --video: players take a file for what its name says."""
    if value is None or value.suffix.lower() == ".mp4":
        return value
    raise click.BadParameter(f"the annotated video is an MP4; name it {value.stem or 'FILE'}.mp4, not {value}.")


_OPTIONS = (
    click.option(
        "--detector",
        type=click.Choice(["disturbance", "paper", "mog2", "knn"]),
        help="How vehicles are told from the scene.  [default: disturbance]",
    ),
    click.option(
        "--video",
        type=click.Path(path_type=Path),
        metavar="FILE.mp4",
        callback=_mp4,
        help="Write an annotated video.",
    ),
    click.option(
        "--save-masks", type=click.Path(path_type=Path), metavar="DIR", help="Write each frame's mask as PNG."
    ),
    click.option(
        "--line",
        "lines",
        multiple=True,
        metavar="NAME:x1,y1,x2,y2",
        help="Count over a line, in pixels; repeat for more.",
    ),
    click.option(
        "--site",
        type=click.Path(path_type=Path),
        metavar="SITE.toml",
        help="Add positions in metres and speeds, by this site's calibration.",
    ),
    click.option("--start", type=float, metavar="S", help="Begin at this time [s]."),
    click.option("--end", type=float, metavar="S", help="Stop at this time [s]."),
    click.option("--scale", type=float, metavar="F", help="Detect in a reduced picture: 1/2, 1/3, ..."),
    click.option("--mask", type=click.Path(path_type=Path), metavar="IMAGE", help="Only where this picture is white."),
)


def tracking_options(function: Function) -> Function:
    """--method, --distance, --detector, --rerun, --video, --save-masks, --line, --site, --decisions, --start, ..."""
    for option in reversed(_OPTIONS):
        function = option(function)
    return association_options(function)


_SETTING = {
    "method": "tracker.method",
    "distance": "tracker.distance",
    "detector": "detector.kind",
    "start": "source.start_s",
    "end": "source.end_s",
    "scale": "source.scale",
    "mask": "source.mask",
    "fps": "source.fps",
    "site": "output.site",
    "smooth": "output.smooth",
    "link": "output.link",
}


def chosen_settings(chosen: dict[str, Any]) -> list[tuple[str, Any]]:
    """The options that stand for a setting, as (name, value)."""
    given = [(_SETTING[name], chosen[name]) for name in _SETTING if chosen.get(name) is not None]
    return given + ([("output.lines", list(chosen["lines"]))] if chosen["lines"] else [])
