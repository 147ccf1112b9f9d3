"""`vidtrack review`: look at counted crossings one by one."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import click

from vidtrack.cli.options import page_options, receives, start_log


@dataclass(frozen=True, kw_only=True)
class ReviewOptions:
    """What `vidtrack review` is told."""

    run: Path
    sample: int | None
    video: str | None
    port: int
    quiet: bool
    verbose: int


@click.command(
    name="review",
    epilog="""\b
Examples:
  vidtrack review monday
  vidtrack review monday --sample 200
  vidtrack review runs/motorway --video /archive/motorway.mp4 --port 8080""",
)
@click.argument("run", type=click.Path(path_type=Path))
@click.option(
    "--sample", type=click.IntRange(min=1), metavar="N", help="N events in random order: a fair sample for a precision."
)
@click.option("--video", metavar="SOURCE", help="Where the tracked video is now.")
@page_options
@receives(ReviewOptions)
def command(options: ReviewOptions) -> None:
    """Serve a page on this machine with one row for each counted crossing in RUN, until Ctrl-C.

    RUN is a folder of vidtrack measure, or a run with --line. The most doubtful crossings come first. Each is right,
    or wrong in one of several ways; missed vehicles are noted too. Verdicts are saved at once to corrections.csv in
    RUN, beside the counts, which stay as they are. vidtrack validate RUN gives the precision that follows.
    """
    from vidtrack.errors import ConfigError
    from vidtrack.output.clips import Clips
    from vidtrack.output.corrections import NAME, CorrectionsFile
    from vidtrack.output.folder import usable
    from vidtrack.output.lock import exclusive
    from vidtrack.serve.review import Review
    from vidtrack.traffic.validation.audit_events import doubtful_order, random_order, read_counted

    start_log(options.verbose, options.quiet)
    counted = read_counted(options.run)
    if not counted.events:
        raise ConfigError(f"{options.run} has no crossings; there is nothing to look at")
    if options.video is not None and len(counted.recordings) > 1:
        raise ConfigError(f"--video is of one run, and {options.run} has {len(counted.recordings)}")
    order = (doubtful_order if options.sample is None else random_order)(counted.events)[: options.sample]
    with exclusive(usable(options.run)):
        file = CorrectionsFile(options.run)
        name = options.run.resolve().name
        clips = Clips(counted, options.video)
        page = Review(name, counted, file, clips, order.tolist(), sampled=options.sample is not None)
        if (why := clips.why_not()) and not options.quiet:
            click.echo(f"vidtrack: no pictures: {why}", err=True)
        _serve(page.app(), options.port, options.quiet)
    if not options.quiet:
        count = len(file.rows)
        click.echo(f"vidtrack: {count} correction{'s' * (count != 1)} in {options.run / NAME}", err=True)


def _serve(app: Callable[..., Any], port: int, quiet: bool) -> None:
    """Serve the page until the first signal."""
    from secrets import token_urlsafe
    from threading import Event

    from vidtrack.cli.signals import stopping
    from vidtrack.serve.access import private
    from vidtrack.serve.listener import listen, url_of
    from vidtrack.serve.server import Server

    token = token_urlsafe(24)
    listener = listen(str(port), None, option="--port")
    server, ended = Server(listener), Event()
    try:
        server.start(private(app, token))
        if not quiet:
            click.echo("vidtrack: open this address in a browser; Ctrl-C ends the page", err=True)
        click.echo(f"{url_of(listener)}#{token}")
        with stopping(ended.set):
            ended.wait()
    finally:
        server.close()
