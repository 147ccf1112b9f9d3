"""`vidtrack live` with several cameras: a status line for each at intervals, a table at the end."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from rich.console import Console
from rich.table import Table

from vidtrack.cli.options import start_log

if TYPE_CHECKING:
    from vidtrack.cli.live import LiveOptions
    from vidtrack.run.live.supervisors import Supervisor, Supervisors
    from vidtrack.run.live.worker import Job
    from vidtrack.serve.camera import Camera
    from vidtrack.serve.page import Page

log = logging.getLogger(__name__)

_REPORT_S = 60.0
_LOOK_S = 0.2


def are_many(sources: Sequence[str]) -> bool:
    """Whether the sources are several cameras, or a file that lists cameras."""
    return len(sources) > 1 or sources[0].lower().endswith(".toml")


def track_many(options: LiveOptions, page: Page | None) -> int:
    """Track all cameras until a signal; the exit code is 0 unless every camera failed."""
    from vidtrack.cli.signals import stopping
    from vidtrack.output.folder import open_run, usable
    from vidtrack.run.live.followed_file import FollowedFile
    from vidtrack.run.live.supervisors import Supervisors
    from vidtrack.service.notify import Reports

    listing = FollowedFile(Path(options.sources[0])) if len(options.sources) == 1 else None
    jobs_in = partial(_jobs, options, partial(start_log, options.verbose, options.quiet))
    jobs_in(Path())  # what is wrong is told before there is a folder
    folder = open_run(None, "live", options.force) if options.output is None else usable(options.output)
    jobs = jobs_in(folder, force=options.force)
    with (
        Supervisors(jobs, folder) as supervisors,
        stopping(supervisors.stop),
        Reports(partial(_report, supervisors, page)),
    ):
        if page is not None:
            page.show(_cameras(supervisors))
        reported_s = time.monotonic()
        while supervisors.running(_LOOK_S):
            if listing is not None and listing.changed():
                _change(supervisors, partial(jobs_in, folder, checked=True), listing.path)
                if page is not None:
                    page.show(_cameras(supervisors))
            if not options.quiet and time.monotonic() - reported_s > _REPORT_S:
                reported_s = time.monotonic()
                for name, supervisor in supervisors.by_camera.items():
                    click.echo(f"{name}: {_line(supervisor)}", err=True)
    if not options.quiet:
        _print_table(supervisors)
    click.echo(folder)
    codes = [supervisor.exit_code or 0 for supervisor in supervisors.by_camera.values() if supervisor.error]
    return max(1, *codes) if len(codes) == len(supervisors.by_camera) else 0


def _jobs(
    options: LiveOptions, prepare: Callable[[str], None], folder: Path, *, force: bool = False, checked: bool = False
) -> list[Job]:
    """The jobs of all cameras, as they are listed now.

    checked  raise an error, too, for what otherwise ends the process of its camera alone

    Raises ConfigError.
    """
    from vidtrack.run.live.cameras import extras_of, listed, named, refuse_shared_site, refuse_unusable, settings_of
    from vidtrack.run.live.worker import Job

    for_all: Mapping[str, Any] = {}
    if len(options.sources) == 1:
        cameras, for_all = listed(Path(options.sources[0]))
    else:
        cameras = named(options.sources)
    wanted = [settings_of(camera, for_all, options.config_file, options.given()) for camera in cameras]
    refuse_shared_site(cameras, wanted)
    own = [extras_of(camera, options.extras()) for camera in cameras]
    for camera, settings, extras in zip(cameras, wanted, own, strict=True):
        extras.receivers.check(settings, options.output)
        if checked:
            refuse_unusable(camera, settings)
    return [
        Job(camera.name, camera.address, settings, folder / camera.name, extras, force, prepare)
        for camera, settings, extras in zip(cameras, wanted, own, strict=True)
    ]


def _change(supervisors: Supervisors, jobs: Callable[[], list[Job]], path: Path) -> None:
    """Track the cameras that are listed now; a list with a mistake changes nothing."""
    from vidtrack.errors import Error

    try:
        changes = supervisors.use(jobs())
    except Error as error:
        log.warning("%s; the cameras go on as they are", str(error).partition("\n")[0])
        return
    log.warning("%s: %s", path, ", ".join(changes) or "no camera has changed")


def _report(supervisors: Supervisors, page: Page | None) -> tuple[bool, str]:
    """Whether all works that a restart could mend, and the state of the cameras in words."""
    working = [supervisor.works() for supervisor in list(supervisors.by_camera.values())]
    words = ", ".join(f"{name}: {camera.words()}" for name, camera in _cameras(supervisors).items())
    return all(working) and (page is None or page.answers()), words


def _cameras(supervisors: Supervisors) -> dict[str, Camera]:
    """The cameras as the page needs them."""
    from vidtrack.serve.camera import Camera

    return {
        name: Camera(
            supervisor.status, supervisor.picture, supervisor.counts, 2 * supervisor.asked.settings.live.timeout_s
        )
        for name, supervisor in supervisors.by_camera.items()
    }


def _line(supervisor: Supervisor) -> str:
    """The status of a camera in one line."""
    if supervisor.error is not None:
        return f"ended: {supervisor.error}"
    status = supervisor.status()
    if "frame" not in status:
        return str(status["state"])
    reading = status["reading"]
    return (
        f"frame {status['frame']}, {reading['fps_in']:.1f} frames/s in, {status['fps_out']:.1f} tracked, "
        f"{reading['frames_dropped']} dropped, {reading['reconnects']} reconnects"
    )


def _print_table(supervisors: Supervisors) -> None:
    columns = ("frames", "tracks", "frames_dropped", "reconnects", "stalls", "restarts")
    summary = supervisors.summary()
    table = Table("camera", *(name.replace("frames_", "") for name in columns), "end")
    for name, camera in summary["cameras"].items():
        end = "by an error" if "error" in camera else "well"
        table.add_row(name, *(str(camera.get(column, "")) for column in columns), end)
    table.add_row("all", *(str(summary[column]) for column in columns), "", style="bold")
    Console(stderr=True).print(table)
