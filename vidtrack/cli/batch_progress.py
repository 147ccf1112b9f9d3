"""Progress of a batch: files, hours of video, time left, failures."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from vidtrack.run.batch.batch import Batch, Progress

_LINE_S = 10.0


@contextmanager
def telling(batch: Batch, engine: str, quiet: bool) -> Iterator[Callable[[Progress], None]]:
    """A function that shows the progress on stderr, a live line on a terminal and lines at intervals otherwise.

    At the end, also after Ctrl-C, it says how far the batch came.
    """
    progress, begun = batch.progress, time.monotonic()
    if quiet:
        yield lambda now: None
        return
    before = f"{progress.before} of {progress.total} are done; " if progress.before else ""
    try:
        click.echo(f"vidtrack: {before}{progress.total - progress.before} to do on {engine}", err=True)
        if sys.stderr.isatty():
            from rich.console import Console
            from rich.live import Live

            with Live(console=Console(stderr=True), transient=True, refresh_per_second=4) as live:
                yield lambda now: live.update(told(now, time.monotonic() - begun))
        else:
            yield _in_lines(begun)
    finally:
        click.echo(f"vidtrack: {told(progress, time.monotonic() - begun)}", err=True)
        if progress.done + progress.aside + progress.before < progress.total:
            click.echo("vidtrack: run the same command again to go on", err=True)


def _in_lines(begun: float) -> Callable[[Progress], None]:
    last = begun

    def tell(now: Progress) -> None:
        nonlocal last
        if time.monotonic() - last > _LINE_S:
            last = time.monotonic()
            click.echo(f"vidtrack: {told(now, last - begun)}", err=True)

    return tell


def told(progress: Progress, elapsed_s: float) -> str:
    """The progress in words. The time left goes by the bytes of the sources, which are known before they are read."""
    hours = progress.media_s / 3600
    words = [
        f"{progress.before + progress.done} of {progress.total} files",
        f"{hours:.2f} h of video",
        f"{hours / max(elapsed_s, 1e-3) * 3600:.1f} h an hour",
    ]
    if 0 < progress.bytes_done < progress.bytes_total:
        left_s = elapsed_s * (progress.bytes_total / progress.bytes_done - 1)
        words.append(
            f"{int(left_s // 3600)}:{int(left_s % 3600 // 60):02d} h left" if left_s >= 60 else f"{left_s:.0f} s left"
        )
    if progress.aside:
        words.append(f"{progress.aside} set aside")
    return ", ".join(words)
