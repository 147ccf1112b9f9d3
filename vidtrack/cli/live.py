"""`vidtrack live`: a camera or a stream becomes tracks until it is stopped."""

from __future__ import annotations

import re
import time
from collections.abc import Mapping
from contextlib import AbstractContextManager, nullcontext
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from vidtrack.cli.options import announce_compiling, common, settings_options, start_log
from vidtrack.cli.tracking import chosen_settings, tracking_options

if TYPE_CHECKING:
    from vidtrack.config import Settings
    from vidtrack.output.status import LiveStatus
    from vidtrack.run.live.outputs import LiveExtras
    from vidtrack.serve.page import Page

_TELL_S = 60.0
_SECONDS = {"s": 1.0, "m": 60.0, "h": 3600.0, "d": 86400.0}
_BYTES = {"MB": 1e6, "GB": 1e9, "TB": 1e12}


@click.command(
    name="live",
    epilog="""\b
Examples:
  vidtrack live 0 --line gate:320,0,320,480
  vidtrack live rtsp://USER:PASSWORD@192.168.1.20/stream -o cam1 --roll 1h --keep 7d --state cam1.state
  vidtrack live http://camera.local/video.mjpg --http 8080 --record tape --end 600""",
)
@click.argument("sources", metavar="SOURCE...", nargs=-1, required=True)
@common("Folder for the results.  [default: runs/NAME]")
@settings_options
@tracking_options
@click.option("--every-frame", is_flag=True, help="Track every frame, and fall behind rather than drop one.")
@click.option("--roll", metavar="TIME", help="Results go on in a new sub-folder after 10m, 1h, 1d, ...")
@click.option("--keep", "keeps", multiple=True, metavar="TIME|SIZE", help="Delete the oldest: 7d or 10GB, or both.")
@click.option("--state", type=click.Path(path_type=Path), metavar="FILE", help="Go on from this file, and save to it.")
@click.option("--record", type=click.Path(path_type=Path), metavar="DIR", help="Keep what the camera sends, to replay.")
@click.option("--http", metavar="[HOST:]PORT", help="Serve a live page; without HOST for this machine only.")
@click.option(
    "--http-token",
    metavar="TOKEN",
    envvar="VIDTRACK_TOKEN",
    show_envvar=True,
    help="The page's password; a must where other machines can see it.",
)
def command(
    sources: tuple[str, ...],
    output: Path | None,
    force: bool,
    quiet: bool,
    verbose: int,
    config_file: Path | None,
    assignments: tuple[str, ...],
    rerun: str | None,
    video: Path | None,
    save_masks: Path | None,
    decisions: bool,
    state: Path | None,
    record: Path | None,
    http: str | None,
    http_token: str | None,
    **chosen: Any,
) -> int:
    """Track the vehicles that SOURCE sees: a camera's index, a V4L2 device, or an rtsp:// or http:// stream.

    Several SOURCEs, or a file cameras.toml that lists them, get a process and a sub-folder each.

    The newest frame is tracked and older ones are dropped when the machine is too slow. A lost camera is opened
    again for as long as it takes. Ctrl-C and SIGTERM end the run, with exit code 0.

    The folder of the results is printed; it holds what vidtrack track writes, with --roll in sub-folders named by
    the time in UTC. Times are seconds since the first picture. What --record keeps, vidtrack track repeats.
    """
    from vidtrack.cli.signals import Terminated

    try:
        from vidtrack.cli.hide import hide_arguments
        from vidtrack.cli.live_many import are_many, track_many
        from vidtrack.config import Input, load
        from vidtrack.run.live.outputs import LiveExtras
        from vidtrack.video.live.address import secrets

        hidden = [text for source in sources for text in secrets(source)]
        hide_arguments([*hidden, *([http_token] if http_token else [])])
        start_log(verbose, quiet)
        given: list[str | tuple[str, Any]] = [*assignments, *chosen_settings(chosen), *_live_settings(**chosen)]
        settings = load(config_file, given, kind=Input.CAMERA)
        announce_compiling(quiet)
        extras = LiveExtras(rerun, video, save_masks, decisions, state, record)
        with _page(http, http_token) as page:
            if page is not None and not quiet:
                click.echo(f"vidtrack: the page is at {page.url}", err=True)
            if are_many(sources):
                log = partial(start_log, verbose, quiet)
                return track_many(sources, output, extras, config_file, given, page, log, force=force, quiet=quiet)
            _track_one(sources[0], settings, output, extras, page, force=force, quiet=quiet)
    except (KeyboardInterrupt, Terminated):
        if not quiet:
            click.echo("vidtrack: stopped before the end of the first picture, or at once", err=True)
    return 0


def _track_one(
    source: str,
    settings: Settings,
    output: Path | None,
    extras: LiveExtras,
    page: Page | None,
    *,
    force: bool,
    quiet: bool,
) -> None:
    from vidtrack.cli.signals import stopping
    from vidtrack.run.live.run import LiveRun
    from vidtrack.serve.camera import Camera

    with LiveRun(source, settings, output, extras, force=force) as run, stopping(run.stop):
        if page is not None:
            page.show({run.name: Camera.of(run.board, stale_s=2 * settings.live.timeout_s)})
        told_s = time.monotonic()
        for _ in run:
            if not quiet and time.monotonic() - told_s > _TELL_S:
                told_s = time.monotonic()
                click.echo(f"{run.name}: {_line(run.board.now())}", err=True)
        if not quiet:
            click.echo(f"{run.name}: {_line(run.board.now())}", err=True)
    click.echo(run.folder)


def _page(http: str | None, token: str | None) -> AbstractContextManager[Page | None]:
    """The live page with its port taken, before any camera is opened."""
    if http is None:
        return nullcontext()
    from vidtrack.serve.page import Page

    return Page(http, token)


def _live_settings(
    every_frame: bool, roll: str | None, keeps: tuple[str, ...], **others: Any
) -> list[tuple[str, float | bool]]:
    """The options of this command that stand for a setting, as (name, value)."""
    given: list[tuple[str, float | bool]] = [("live.every_frame", True)] if every_frame else []
    if roll is not None:
        given.append(("live.roll_s", _amount("--roll", roll, {"live.roll_s": _SECONDS})[1]))
    return given + [_amount("--keep", text, {"live.keep_s": _SECONDS, "live.keep_bytes": _BYTES}) for text in keeps]


def _amount(option: str, text: str, units: Mapping[str, Mapping[str, float]]) -> tuple[str, float]:
    """The setting that the unit belongs to, and the amount in seconds or bytes. Raises click.BadParameter."""
    match = re.fullmatch(r"(\d+\.?\d*) ?([a-zA-Z]+)", text)
    for setting, factors in units.items():
        if match and match[2] in factors:
            return setting, float(match[1]) * factors[match[2]]
    known = ", ".join(unit for factors in units.values() for unit in factors)
    raise click.BadParameter(f"{text!r}: write a number and a unit, one of {known}", param_hint=option)


def _line(status: LiveStatus) -> str:
    """The run in one line."""
    reading = status.reading
    latency = reading["latency_ms"]
    return (
        f"frame {status.frame}, {reading['fps_in']:.1f} frames/s in, {status.fps_out:.1f} tracked, "
        f"{len(status.tracks)} tracks, {reading['frames_dropped']} dropped, {reading['reconnects']} reconnects, "
        f"latency {latency.get('p50', 0):.0f} ms"
    )
