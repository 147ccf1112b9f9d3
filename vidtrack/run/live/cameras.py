"""The cameras of a live run: given as addresses, or listed in a TOML file with settings of their own."""

from __future__ import annotations

import re
import sys
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from itertools import count
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from vidtrack.config.group import read_toml
from vidtrack.config.inputs import Input
from vidtrack.config.load import load, merged
from vidtrack.config.settings import Settings
from vidtrack.errors import ConfigError, Error
from vidtrack.run.live.outputs import LiveExtras
from vidtrack.traffic.lines import parse_lines
from vidtrack.traffic.site import read_site
from vidtrack.video.live.address import parse_address, redact

_CAMERAS, _ADDRESS = "camera", "address"
_OF_MANY = {"live": {"retry_first": True}}
"""Settings of several cameras that differ from those of one: a camera may start later than this machine."""


@dataclass(frozen=True, slots=True)
class Entry:
    """One camera.

    name      names its folder and its place on the page
    address   of the source; may contain a password
    settings  nested; they override the settings for all cameras
    """

    name: str
    address: str
    settings: Mapping[str, Any]


def listed(path: Path) -> tuple[list[Entry], dict[str, Any]]:
    """The cameras listed in a file, and the file's settings for all cameras.

    Each table [camera.NAME] has an `address` and optional settings; the rest of the file are settings for all cameras.
    Raises ConfigError if the file cannot be read or lists no camera.
    """
    tree = read_toml(path, "the list of cameras")
    tables = tree.pop(_CAMERAS, {})
    if not isinstance(tables, dict) or not tables:
        raise ConfigError(f"{path} lists no camera; give each a table [{_CAMERAS}.NAME] with its {_ADDRESS}")
    return [_camera(path, name, table) for name, table in tables.items()], tree


def named(addresses: Iterable[str]) -> list[Entry]:
    """Cameras with unique names made from their addresses."""
    cameras: list[Entry] = []
    for address in addresses:
        wanted = _as_folder(_name(address))
        names = (wanted if number == 1 else f"{wanted}-{number}" for number in count(1))
        taken = {camera.name for camera in cameras}
        cameras.append(Entry(next(name for name in names if name not in taken), address, {}))
    return cameras


def settings_of(
    camera: Entry, base: Mapping[str, Any], path: Path | None, assignments: Iterable[str | tuple[str, Any]]
) -> Settings:
    """A camera's settings: those for all, overridden by its own, then by --config and --set.

    Raises ConfigError, naming the camera.
    """
    try:
        return load(path, assignments, merged(merged(_OF_MANY, base), camera.settings), Input.CAMERA)
    except ConfigError as error:
        raise ConfigError(f"camera {camera.name}: {error}") from None


def refuse_shared_site(cameras: Iterable[Entry], settings: Iterable[Settings]) -> None:
    """Raise ConfigError where two cameras have one site: a site is what one camera sees."""
    owners: dict[Path, str] = {}
    for camera, wanted in zip(cameras, settings, strict=True):
        site = wanted.output.site
        if site is None:
            continue
        other = owners.setdefault(site.resolve(), camera.name)
        if other != camera.name:
            raise ConfigError(
                f"{site} cannot be the site of both {other} and {camera.name}: a site is of one camera; list the "
                f'cameras in a file, each with its own: [{_CAMERAS}."{other}"] with output.site = "{other}.toml"'
            )


def refuse_unusable(camera: Entry, settings: Settings) -> None:
    """Raise ConfigError or SourceError for what a camera's process would end with, as far as it can be known before."""
    try:
        parse_lines(settings.output.lines, sys.maxsize, sys.maxsize)
        if settings.output.site is not None:
            read_site(settings.output.site)
        if "://" in camera.address:  # a device may be plugged in later
            parse_address(camera.address, settings.live.timeout_s)
    except Error as error:
        raise ConfigError(f"camera {camera.name}: {error}") from None


def extras_of(camera: Entry, extras: LiveExtras) -> LiveExtras:
    """Output places of one camera: sub-folders with its name, files with its name before the extension."""
    if extras.rerun in ("spawn", "serve"):
        raise ConfigError(
            f"--rerun {extras.rerun} shows one camera; give FILE.rrd for a recording of each, or use --http"
        )
    return replace(
        extras,
        rerun=extras.rerun and str(_file(Path(extras.rerun), camera)),
        video=extras.video and _file(extras.video, camera),
        state=extras.state and _file(extras.state, camera),
        masks=extras.masks and extras.masks / camera.name,
        record=extras.record and extras.record / camera.name,
        receivers=replace(extras.receivers, camera=camera.name) if extras.receivers else extras.receivers,
    )


def _camera(path: Path, name: str, table: Any) -> Entry:
    address = table.pop(_ADDRESS, None) if isinstance(table, dict) else None
    if isinstance(address, int):  # a camera's index
        address = str(address)
    if not isinstance(address, str):
        raise ConfigError(f'{path}: [{_CAMERAS}.{name}] needs {_ADDRESS} = "rtsp://...", a device or an index')
    if _as_folder(name) != name:
        raise ConfigError(f"{path}: camera {name!r}: use letters, digits, - and _ for a name, it becomes a folder")
    return Entry(name, address, table)


def _name(address: str) -> str:
    """The host of an address, or the name of a device."""
    if "://" in address:
        return urlsplit(redact(address)).netloc.rpartition("@")[2]
    return f"video{address}" if address.isdecimal() else Path(address).name


def _as_folder(name: str) -> str:
    return re.sub(r"[^\w.-]+", "_", name).strip("._") or "camera"


def _file(path: Path, camera: Entry) -> Path:
    return path.with_name(f"{path.stem}-{camera.name}{path.suffix}")
