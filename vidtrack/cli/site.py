"""`vidtrack site`: draws a site over the tracks of a run."""

from __future__ import annotations

import json
import re
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from vidtrack.cli.options import receives, start_log

if TYPE_CHECKING:
    from vidtrack.serve.site.app import Picture


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
    short_help="Draw a site's gates, zones and points over the tracks of a run.",
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
    help="The file to draw; made if it is not there.  [default: the one RUN was tracked with, else RUN/site.toml]",
)
@click.option("--picture", metavar="IMAGE|VIDEO", help="Draw over this, or over its first picture.")
@click.option(
    "--plan",
    type=click.Path(path_type=Path),
    metavar="IMAGE",
    help="A plan or aerial picture, north up, to take metres from; its world file is used.",
)
@click.option(
    "--port", type=click.IntRange(0, 65535), default=0, help="Serve the page at this port.  [default: any free one]"
)
@click.option("-q", "--quiet", is_flag=True, help="Only errors and the address of the page.")
@click.option("-v", "--verbose", count=True, help="Say more; twice: everything.")
@receives(SiteOptions)
def command(options: SiteOptions) -> None:
    """Draw gates, zones, sections, movements and calibration points over the tracks of RUN, in a browser.

    The address of the page is printed; it works in a browser on this machine, until Ctrl-C. Counts follow the gates
    while they are drawn, with the rules of vidtrack measure. Only Save in the page writes the site's file.
    """
    import secrets
    from threading import Event

    from vidtrack.cli.signals import Terminated
    from vidtrack.errors import SourceError
    from vidtrack.recording.retention import parts_of
    from vidtrack.serve.access import private
    from vidtrack.serve.listener import LOOPBACK, listen, url_of
    from vidtrack.serve.server import Server
    from vidtrack.serve.site.app import Desk
    from vidtrack.serve.site.file import SiteFile
    from vidtrack.serve.site.plan import read_world
    from vidtrack.traffic.measures.recount import Recount
    from vidtrack.traffic.site import Site

    start_log(options.verbose, options.quiet)
    runs = [str(part) for part in parts_of(options.run)] or [str(options.run)]
    recount = Recount(runs)
    file = SiteFile(options.site or _tracked_with(Path(runs[-1])) or options.run / "site.toml")
    if not file.path.parent.is_dir():
        raise SourceError(f"{file.path.parent}, where the site is to be saved, is no folder")
    tree, _ = file.read()
    new = {
        "site": {"name": _name(options.run.resolve().name)} | dict(zip(("width", "height"), recount.size, strict=True))
    }
    drawn = Site.model_validate(tree or new)
    drawn.scaled(*recount.size)  # refuses a run of another shape
    plan = None
    if options.plan is not None:
        read_world(options.plan)
        plan = options.plan, _encoded(str(options.plan))
    desk = Desk(options.run.name, recount, file, new, _scene(options, Path(runs[-1]), drawn), plan)
    token = secrets.token_urlsafe(16)
    listener = listen(f"{LOOPBACK}:{options.port}", None)
    server = Server(listener)
    server.start(private(desk.app(), token))
    try:
        if not options.quiet:
            click.echo(f"vidtrack: draws {file.path}; open this address in a browser, and end with Ctrl-C", err=True)
        click.echo(f"{url_of(listener)}#{token}")
        Event().wait()
    except (KeyboardInterrupt, Terminated):
        pass
    finally:
        server.close()


def _tracked_with(run: Path) -> Path | None:
    """The site that a run was tracked with, if its file is still there."""
    settings: dict[str, Any] = json.loads((run / "summary.json").read_text(encoding="utf-8"))["settings"]
    site = (settings.get("output") or {}).get("site")
    return Path(site) if site and Path(site).is_file() else None


def _name(folder: str) -> str:
    """A name for a new site: that of the run, as far as names allow."""
    return re.sub(r"[^\w .-]+", "_", folder).strip("_ .-")[:64].strip() or "site"


def _scene(options: SiteOptions, run: Path, drawn: Any) -> Picture | None:
    """What is drawn over: a given picture, else the run's scene, else its paths over the scene."""
    from vidtrack.cli.calibrate import first_picture
    from vidtrack.output.scene import SCENE
    from vidtrack.serve.site.app import Picture

    if options.picture is not None:
        height, width = first_picture(options.picture).shape[:2]
        drawn.scaled(width, height)  # refuses a picture of another shape
        return _encoded(options.picture)
    for name, kind in ((SCENE, "image/jpeg"), ("tracks.png", "image/png")):
        if (run / name).is_file():
            return Picture(name, (run / name).read_bytes(), kind)
    return None


def _encoded(source: str) -> Picture:
    from vidtrack.cli.calibrate import first_picture
    from vidtrack.output.scene import jpeg
    from vidtrack.serve.site.app import Picture

    return Picture(Path(source).name, jpeg(first_picture(source)), "image/jpeg")
