"""Options common to several commands, and the dataclasses that hold them."""

from __future__ import annotations

import logging
import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

if TYPE_CHECKING:
    from vidtrack.config.inputs import Input
    from vidtrack.config.settings import Settings

Function = TypeVar("Function", bound=Callable[..., Any])
Received = TypeVar("Received")

SETTING = {
    "method": "tracker.method",
    "distance": "tracker.distance",
    "detector": "detector.kind",
    "estimator": "radar.estimator",
    "model": "radar.model",
    "snr_db": "radar.snr_db",
    "group": "radar.group_link_m",
    "start": "source.start_s",
    "end": "source.end_s",
    "scale": "source.scale",
    "mask": "source.mask",
    "fps": "source.fps",
    "max_fps": "source.max_fps",
    "decoder": "source.decoder",
    "skip_bad_rows": "radar.skip_bad_rows",
    "radar_position": "radar.geodetic",
    "smooth": "output.smooth",
    "link": "output.link",
    "lines": "output.lines",
    "site": "output.site",
    "every_frame": "live.every_frame",
}
"""Options that set a setting, in all commands."""


@dataclass(frozen=True, kw_only=True)
class Options:
    """Options of every command, see `common`."""

    output: Path | None
    force: bool
    quiet: bool
    verbose: int

    def folder(self, name: str) -> Path | None:
        """The folder of -o, checked to be writable; None without -o. Raises OutputError."""
        from vidtrack.output.folder import open_folder

        return None if self.output is None else open_folder(self.output, name, self.force)


@dataclass(frozen=True, kw_only=True)
class WithSettings(Options):
    """Options of commands with settings: --config, --set, and options that set a setting."""

    config_file: Path | None
    assignments: tuple[str, ...]

    def given(self) -> list[str | tuple[str, Any]]:
        """The settings on the command line: those of --set, then those of single options."""
        own = {field.name for field in fields(self)} & SETTING.keys()
        chosen = [(setting, getattr(self, name)) for name, setting in SETTING.items() if name in own]
        listed = [(setting, list(value) if isinstance(value, tuple) else value) for setting, value in chosen]
        return [*self.assignments, *((setting, value) for setting, value in listed if value not in (None, []))]

    def settings(self, kind: Input | None = None, base: Mapping[str, Any] | None = None) -> Settings:
        """The effective settings, see `config.load`. Raises ConfigError."""
        from vidtrack.config.load import load

        return load(self.config_file, self.given(), base, kind)


def receives(kind: type[Received]) -> Callable[[Callable[[Received], Any]], Callable[..., Any]]:
    """Pass all parameters to a command as one object of a dataclass with their names."""

    def decorate(function: Callable[[Received], Any]) -> Callable[..., Any]:
        @wraps(function)
        def command(**parameters: Any) -> Any:
            return function(kind(**parameters))

        return command

    return decorate


def common(output_help: str) -> Callable[[Function], Function]:
    """-o, --force, --quiet, -v, for every command that writes results."""

    def decorate(function: Function) -> Function:
        for option in (
            click.option("-v", "--verbose", count=True, help="Say more; twice: everything."),
            click.option("-q", "--quiet", is_flag=True, help="Only errors: no progress, no warnings."),
            click.option("--force", is_flag=True, help="Replace the results in a folder that is not empty."),
            click.option("-o", "--output", type=click.Path(path_type=Path), metavar="DIR", help=output_help),
        ):
            function = option(function)
        return function

    return decorate


def settings_options(function: Function) -> Function:
    """--config and --set."""
    function = click.option(
        "--set", "assignments", multiple=True, metavar="A.B=VALUE", help="One setting; repeat for more."
    )(function)
    return click.option(
        "--config", "config_file", type=click.Path(path_type=Path), metavar="FILE.toml", help="Settings from a file."
    )(function)


def page_options(function: Function) -> Function:
    """--port, --quiet and --verbose, for commands that serve a page."""
    for option in (
        click.option("-v", "--verbose", count=True, help="Say more; twice: everything."),
        click.option("-q", "--quiet", is_flag=True, help="Only errors and the address of the page."),
        click.option(
            "--port",
            type=click.IntRange(0, 65535),
            default=0,
            help="Serve the page at this port.  [default: any free one]",
        ),
    ):
        function = option(function)
    return function


class _Geodetic(click.ParamType):
    """LAT,LON or LAT,LON,HEIGHT as three numbers."""

    name = "LAT,LON[,HEIGHT]"

    def convert(
        self, value: object, param: click.Parameter | None, ctx: click.Context | None
    ) -> tuple[float, float, float]:
        try:
            latitude, longitude, *height = map(float, str(value).split(","))
            (above,) = height or [0.0]
        except ValueError:
            self.fail(f"{value!r} is not LAT,LON or LAT,LON,HEIGHT such as 52.36,13.51,48", param, ctx)
        if not (abs(latitude) <= 90 and abs(longitude) <= 180 and abs(above) <= 1e5):
            self.fail(f"{value!r}: a latitude is in -90..90, a longitude in -180..180 degrees", param, ctx)
        return latitude, longitude, above


def radar_position_option(help_text: str) -> Callable[[Function], Function]:
    """--radar-position, for commands that put radar tracks on the earth."""
    return click.option("--radar-position", type=_Geodetic(), help=help_text)


def seed_option(function: Function) -> Function:
    """--seed, for commands with random numbers."""
    return click.option(
        "--seed",
        type=click.IntRange(min=0),
        default=0,
        show_default=True,
        help="The same seed gives the same random numbers.",
    )(function)


def start_log(verbose: int, quiet: bool, who: str = "") -> None:
    """Log the library's warnings to stderr in the form of our messages; `who` names the camera."""
    level = logging.ERROR if quiet else (logging.WARNING, logging.INFO, logging.DEBUG)[min(verbose, 2)]
    handler = logging.StreamHandler()
    about = f"{who}: " if who else ""
    handler.setFormatter(logging.Formatter(f"vidtrack: {about}%(levelname)s: %(message)s"))
    logging.addLevelName(logging.ERROR, "error")
    logging.addLevelName(logging.WARNING, "warning")
    logging.addLevelName(logging.INFO, "info")
    logger = logging.getLogger("vidtrack")
    handler.setLevel(level)
    logger.handlers = [handler]
    os.environ.setdefault("RUST_LOG", "off")  # rerun's log: its errors are raised as OutputError
    logger.setLevel(min(level, logging.WARNING))


def announce_compiling(quiet: bool, video: bool = True) -> None:
    """Report before the first run that it compiles the kernels; of video on both sides of them at once."""
    from vidtrack.compiled import first_run

    if not first_run():
        return
    if not quiet:
        click.echo("vidtrack: compiling for this machine, once; it takes up to half a minute", err=True)
    if video:
        from vidtrack.run.warm import warm_beside

        warm_beside()
