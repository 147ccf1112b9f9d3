"""`vidtrack live`: tracks a camera or stream until stopped."""

from __future__ import annotations

import re
import time
from collections.abc import Mapping
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from vidtrack.cli.options import announce_compiling, common, receives, settings_options, start_log
from vidtrack.cli.tracking import PictureOptions, picture_options

if TYPE_CHECKING:
    from vidtrack.config.settings import Settings
    from vidtrack.output.status import LiveStatus
    from vidtrack.run.live.outputs import LiveExtras
    from vidtrack.serve.page import Page

_REPORT_S = 60.0
_KINDS = ("", "tracks", "recordings", "counts", "pictures")
_SECONDS = {"s": 1.0, "m": 60.0, "h": 3600.0, "d": 86400.0}
_BYTES = {"MB": 1e6, "GB": 1e9, "TB": 1e12}


@dataclass(frozen=True, kw_only=True)
class LiveOptions(PictureOptions):
    """Options of `vidtrack live`."""

    sources: tuple[str, ...]
    every_frame: bool | None
    roll: str | None
    keeps: tuple[str, ...]
    state: Path | None
    record: Path | None
    http: str | None
    http_token: str | None
    mqtt: str | None
    webhook: str | None
    webhook_token: str | None

    def given(self) -> list[str | tuple[str, Any]]:
        """The settings on the command line, with --roll and --keep in seconds or bytes. Raises click.BadParameter."""
        given = super().given()
        if self.roll is not None:
            given.append(amount("--roll", self.roll, {"live.roll_s": _SECONDS}))
        return [*given, *map(kept, self.keeps)]

    def extras(self) -> LiveExtras:
        """The optional outputs."""
        from vidtrack.run.live.events import Receivers
        from vidtrack.run.live.outputs import LiveExtras

        receivers = Receivers(self.mqtt, self.webhook, self.webhook_token)
        return LiveExtras(
            *(self.rerun, self.video, self.save_masks, self.decisions, self.state, self.record), receivers=receivers
        )


def kept(text: str) -> tuple[str, float]:
    """The setting and its value of --keep [KIND:]TIME|SIZE. Raises click.BadParameter."""
    kind, colon, value = text.rpartition(":")
    if kind not in _KINDS or (colon and not kind):
        raise click.BadParameter(f"{text!r}: {kind!r} is not one of {', '.join(_KINDS[1:])}", param_hint="--keep")
    units = {f"live.keep_{kind and f'{kind}_'}s": _SECONDS}
    if kind != "counts":  # they take next to nothing
        units[f"live.keep_{kind and f'{kind}_'}bytes"] = _BYTES
    return amount("--keep", value, units)


def amount(option: str, text: str, units: Mapping[str, Mapping[str, float]]) -> tuple[str, float]:
    """The setting of the unit, and the amount in seconds or bytes. Raises click.BadParameter."""
    match = re.fullmatch(r"(\d+\.?\d*) ?([a-zA-Z]+)", text)
    for setting, factors in units.items():
        if match and match[2] in factors:
            return setting, float(match[1]) * factors[match[2]]
    known = ", ".join(unit for factors in units.values() for unit in factors)
    raise click.BadParameter(f"{text!r}: write a number and a unit, one of {known}", param_hint=option)


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
@picture_options
@click.option(
    "--every-frame", is_flag=True, default=None, help="Track every frame, and fall behind rather than drop one."
)
@click.option(
    "--roll", metavar="TIME", help="Results go on in a new sub-folder after 10m, 1h, 1d, ...  [with --keep, --site: 1h]"
)
@click.option(
    "--keep",
    "keeps",
    multiple=True,
    metavar="[KIND:]TIME|SIZE",
    help="Delete the oldest tracks and recordings: 7d or 10GB, or both; or of one KIND: tracks, recordings, counts, "
    "pictures.",
)
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
@click.option(
    "--mqtt",
    metavar="ADDRESS",
    envvar="VIDTRACK_MQTT",
    show_envvar=True,
    help="Send events to a broker: mqtt[s]://[USER:PASSWORD@]HOST[:PORT][/PREFIX].",
)
@click.option(
    "--webhook",
    metavar="ADDRESS",
    envvar="VIDTRACK_WEBHOOK",
    show_envvar=True,
    help="Post events as JSON to http[s]://[USER:PASSWORD@]HOST/PATH.",
)
@click.option(
    "--webhook-token",
    metavar="TOKEN",
    envvar="VIDTRACK_WEBHOOK_TOKEN",
    show_envvar=True,
    help="Sent with each webhook as bearer token.",
)
@receives(LiveOptions)
def command(options: LiveOptions) -> int:
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
        from vidtrack.cli.live_cameras import are_many, track_many
        from vidtrack.config.inputs import Input
        from vidtrack.output.events.address import secret_parts
        from vidtrack.video.live.address import secrets

        hidden = [text for source in options.sources for text in secrets(source)]
        hidden += secret_parts(options.mqtt, options.webhook)
        hide_arguments([*hidden, *filter(None, (options.http_token, options.webhook_token))])
        start_log(options.verbose, options.quiet)
        settings = options.settings(Input.CAMERA)
        announce_compiling(options.quiet)
        with _page(options.http, options.http_token) as page:
            if page is not None and not options.quiet:
                click.echo(f"vidtrack: the page is at {page.url}", err=True)
            if are_many(options.sources):
                return track_many(options, page)
            _track_one(options, settings, page)
    except (KeyboardInterrupt, Terminated):
        if not options.quiet:
            click.echo("vidtrack: stopped before the end of the first picture, or at once", err=True)
    return 0


def _track_one(options: LiveOptions, settings: Settings, page: Page | None) -> None:
    from vidtrack.cli.signals import stopping
    from vidtrack.output.status import is_stuck
    from vidtrack.run.live.run import LiveRun
    from vidtrack.run.live.view import View
    from vidtrack.serve.camera import Camera
    from vidtrack.service.notify import Reports
    from vidtrack.video.live.address import parse_address

    stale_s = 2 * settings.live.timeout_s
    address = parse_address(options.sources[0], settings.live.timeout_s)
    view = View(address.shown)
    camera = Camera(view.status, view.picture, lambda: view.counts, stale_s)
    if page is not None:
        page.show({address.name: camera})

    def report() -> tuple[bool, str]:
        return not is_stuck(view.status(), stale_s) and (page is None or page.answers()), camera.words()

    with (
        Reports(report),
        LiveRun(
            options.sources[0], settings, options.output, options.extras(), force=options.force, stats=view.stats
        ) as run,
        stopping(run.stop),
    ):
        view.board, view.counts = run.board, run.counts
        reported_s = time.monotonic()
        for _ in run:
            if not options.quiet and time.monotonic() - reported_s > _REPORT_S:
                reported_s = time.monotonic()
                click.echo(f"{run.name}: {_line(run.board.now())}", err=True)
        if not options.quiet:
            click.echo(f"{run.name}: {_line(run.board.now())}", err=True)
    click.echo(run.folder)


def _page(http: str | None, token: str | None) -> AbstractContextManager[Page | None]:
    """The live page, with its port bound before any camera is opened."""
    if http is None:
        return nullcontext()
    from vidtrack.serve.page import Page

    return Page(http, token)


def _line(status: LiveStatus) -> str:
    """The status of the run in one line."""
    reading = status.reading
    latency = reading["latency_ms"]
    return (
        f"frame {status.frame}, {reading['fps_in']:.1f} frames/s in, {status.fps_out:.1f} tracked, "
        f"{len(status.tracks)} tracks, {reading['frames_dropped']} dropped, {reading['reconnects']} reconnects, "
        f"latency {latency.get('p50', 0):.0f} ms"
    )
