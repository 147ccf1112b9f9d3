"""`vidtrack site`: draws a site over the tracks of a run."""

from __future__ import annotations

import json
import logging
import re
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from vidtrack.cli.options import page_options, receives, start_log

if TYPE_CHECKING:
    from vidtrack.serve.site.app import Desk, Picture
    from vidtrack.traffic.site import Site

log = logging.getLogger(__name__)


@dataclass(frozen=True, kw_only=True)
class SiteOptions:
    """Options of `vidtrack site`."""

    run: Path
    site: Path | None
    picture: str | None
    plan: Path | None
    port: int
    quiet: bool
    verbose: int


@click.command(
    name="site",
    epilog="""\b
Examples:
  vidtrack site runs/traffic
  vidtrack site runs/traffic --site junction.toml --plan plan.png
  vidtrack site runs/traffic --picture traffic.mp4 --port 8090""",
)
@click.argument("run", type=click.Path(path_type=Path))
@click.option(
    "--site",
    type=click.Path(path_type=Path),
    metavar="SITE.toml",
    help="The file to draw; made if it is not there.  [default: the one RUN was tracked with, else RUN-site.toml]",
)
@click.option("--picture", metavar="IMAGE|VIDEO", help="Draw over this, or over its first picture.")
@click.option(
    "--plan",
    type=click.Path(path_type=Path),
    metavar="IMAGE",
    help="A plan or aerial picture, north up, to take metres from; its world file is used.",
)
@page_options
@receives(SiteOptions)
def command(options: SiteOptions) -> None:
    """Draw gates, zones, sections, movements and calibration points over the tracks of RUN, in a browser.

    RUN may still go on: vidtrack live --site uses what Save writes from then on.

    The address of the page is printed; it works in a browser on this machine, until Ctrl-C. Counts follow the gates
    while they are drawn, with the rules of vidtrack measure. Only Save in the page writes the site's file.
    """
    import secrets
    from threading import Event

    from vidtrack.cli.signals import Terminated
    from vidtrack.serve.access import private
    from vidtrack.serve.listener import LOOPBACK, listen, url_of
    from vidtrack.serve.server import Server

    start_log(options.verbose, options.quiet)
    desk = desk_of(options)
    listener = listen(f"{LOOPBACK}:{options.port}", None, "--port")
    server = Server(listener)
    token = secrets.token_urlsafe(16)
    server.start(private(desk.app(), token))
    try:
        if not options.quiet:
            click.echo(f"vidtrack: draws {desk.file.path}; open this address, and end with Ctrl-C", err=True)
        click.echo(f"{url_of(listener)}#{token}")
        Event().wait()
    except (KeyboardInterrupt, Terminated):
        pass
    finally:
        server.close()


def desk_of(options: SiteOptions) -> Desk:
    """What the options ask for. Raises an Error for a run, a site or a picture that does not fit."""
    from vidtrack.errors import SourceError
    from vidtrack.output.scene import SCENE
    from vidtrack.recording.retention import parts_of
    from vidtrack.serve.site.app import Desk
    from vidtrack.serve.site.file import SiteFile
    from vidtrack.serve.site.plan import read_world
    from vidtrack.traffic.measures.recount import Recount
    from vidtrack.traffic.measures.runs import parts_with_tracks
    from vidtrack.traffic.site import Site

    run = options.run.resolve()
    parts = parts_with_tracks(run, parts_of(run)) or [options.run]
    recount = Recount([str(part) for part in parts])
    file = SiteFile(options.site or _tracked_with(parts[-1]) or run.with_name(f"{run.name}-site.toml"))
    if not file.path.parent.is_dir():
        raise SourceError(f"{file.path.parent}, where the site is to be saved, is no folder")
    tree, _ = file.read()
    width, height = recount.size
    new = {"site": {"name": _name(run.name), "width": width, "height": height}}
    drawn = Site.model_validate(tree or new)
    drawn.scaled(width, height)  # refuses a run of another shape
    plan = None
    if options.plan is not None:
        read_world(options.plan)  # refuses what is none
        plan = options.plan, _encoded(str(options.plan), None)
    live = run / SCENE if options.picture is None and run != parts[-1] else None
    scene = _encoded(options.picture, drawn) if options.picture is not None else _scene(parts, live)
    return Desk(run.name, recount, file, new, scene, plan, live)


def _tracked_with(run: Path) -> Path | None:
    """The site that a run was tracked with, if its file is still there."""
    settings: dict[str, Any] = json.loads((run / "summary.json").read_text(encoding="utf-8"))["settings"]
    site = (settings.get("output") or {}).get("site")
    return Path(site) if site and Path(site).is_file() else None


def _name(folder: str) -> str:
    """A name for a new site: that of the run, as far as names allow."""
    return re.sub(r"[^\w .-]+", "_", folder).strip("_ .-")[:64].strip() or "site"


def _scene(runs: list[Path], live: Path | None) -> Picture | None:
    """The newest scene of ended parts; of those without one, their paths over it."""
    from vidtrack.output.scene import SCENE
    from vidtrack.serve.site.app import Picture

    for run in reversed(runs):
        for name, kind in ((SCENE, "image/jpeg"), ("tracks.png", "image/png")):
            if (run / name).is_file():
                return Picture(name, (run / name).read_bytes(), kind)
    if live is None or not live.is_file():
        log.warning("%s has no picture yet, so the page is grey; give one with --picture", runs[-1])
    return None


def _encoded(source: str, drawn: Site | None) -> Picture:
    """An image, or the first picture of a video. Raises ConfigError where it has not the shape of the drawn site."""
    from vidtrack.cli.calibrate import first_picture
    from vidtrack.output.scene import jpeg
    from vidtrack.serve.site.app import Picture

    picture = first_picture(source)
    if drawn is not None:
        drawn.scaled(picture.shape[1], picture.shape[0])
    return Picture(Path(source).name, jpeg(picture), "image/jpeg")
