"""`vidtrack doctor`: measures a source and advises on settings."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from vidtrack.cli.json_file import deliver, json_option
from vidtrack.cli.options import WithSettings, announce_compiling, common, receives, settings_options, start_log

if TYPE_CHECKING:
    from vidtrack.doctor.advice import Advice
    from vidtrack.doctor.findings import Findings

_FAILED = 1


@dataclass(frozen=True, kw_only=True)
class DoctorOptions(WithSettings):
    """Options of `vidtrack doctor`."""

    source: str | None
    warm: bool
    seconds: float
    scale: float | None
    mask: Path | None
    fps: float | None
    max_fps: float | None
    start: float | None
    json_to: str | None


@click.command(
    name="doctor",
    epilog="""\b
Examples:
  vidtrack doctor traffic.avi
  vidtrack doctor rtsp://USER:PASSWORD@192.168.1.20/stream --seconds 60 --json - | jq .advice
  vidtrack doctor --warm""",
)
@click.argument("source", required=False)
@click.option("--warm", is_flag=True, help="Only compile what runs over video need: once, as for a container image.")
@click.option("--seconds", type=click.FloatRange(min=1), default=10.0, show_default=True, help="Look at so much of it.")
@settings_options
@click.option("--scale", type=float, metavar="F", help="As for track: detect in a reduced picture.")
@click.option("--mask", type=click.Path(path_type=Path), metavar="IMAGE", help="As for track: look where it is white.")
@click.option("--fps", type=float, metavar="N", help="As for track: the true rate.")
@click.option("--max-fps", type=float, metavar="N", help="As for track: look at no more pictures a second.")
@click.option("--start", type=float, metavar="S", help="Begin at this time [s].")
@json_option
@common("Folder for doctor.json.  [default: only printed]")
@receives(DoctorOptions)
def command(options: DoctorOptions) -> int:
    """Look at SOURCE for some seconds: a video, an image folder or glob, a MOT det.txt, a camera or a stream.

    Measures rate, light, noise, flicker, shake, what moves, and whether this machine keeps up; says what will hurt a
    run with these settings, and what to set. Exit code 0: nothing will; 1: something will; 3: it gives no pictures.
    """
    if options.warm or options.source is None:
        return _warm(options)
    from vidtrack.cli.hide import hide_arguments
    from vidtrack.doctor.advice import judge
    from vidtrack.doctor.examine import examine
    from vidtrack.doctor.opening import kind_of
    from vidtrack.video.live.address import secrets

    hide_arguments(secrets(options.source))
    start_log(options.verbose, quiet=not options.verbose)  # the advice contains the warnings
    settings = options.settings(kind_of(options.source))
    announce_compiling(options.quiet)
    folder = options.folder("doctor")
    findings = examine(options.source, settings, options.seconds)
    advice = judge(findings, settings)
    if deliver(_content(findings, advice), options.json_to, folder and folder / "doctor.json", options.quiet):
        _print_report(findings, advice)
    return _FAILED if any(one.problem for one in advice) else 0


def _warm(options: DoctorOptions) -> int:
    """Compile ahead. Raises UsageError for anything beside --warm, or for neither source nor --warm."""
    if not options.warm:
        raise click.UsageError("give a SOURCE to look at, or --warm")
    if options.source is not None or options.given() or options.config_file or options.json_to or options.output:
        raise click.UsageError("--warm looks at no source and reads no settings; give it alone")
    from time import perf_counter

    from vidtrack.compiled import CACHE
    from vidtrack.errors import Error
    from vidtrack.run.warm import warm

    if not CACHE:
        raise Error("compiled kernels cannot be kept: no folder is writable; name one in NUMBA_CACHE_DIR")
    begin = perf_counter()
    warm()
    if not options.quiet:
        click.echo(f"ready for video after {perf_counter() - begin:.1f} s")
    return 0


def _content(findings: Findings, advice: Sequence[Advice]) -> dict[str, Any]:
    from dataclasses import asdict

    fine = not any(one.problem for one in advice)
    return {"fine": fine, **asdict(findings), "advice": [asdict(one) for one in advice]}


def _print_report(findings: Findings, advice: Sequence[Advice]) -> None:
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    table = Table("measured", "value", title=Text(findings.source))
    for name, value in _rows(findings):
        table.add_row(name, value)
    console = Console()
    console.print(table)
    for one in advice:
        style = "bold red" if one.problem else "bold"
        options = "".join(f"\n    {option}" for option in one.options)
        console.print(Text.assemble((f"{one.name}: ", style), one.text, (options, "green")), soft_wrap=True)
    if not any(one.problem for one in advice):
        console.print("nothing that will hurt was found", style="green")


def _rows(findings: Findings) -> Iterator[tuple[str, str]]:
    """Name and text of each measurement."""
    yield "picture", f"{findings.width} x {findings.height} px"
    if (timing := findings.timing) is not None:
        yield "rate", f"{timing.rate:.4g} frames/s over {timing.pictures} pictures"
        yield "intervals", f"vary by {timing.jitter:.1%}, longest {1e3 * timing.longest_gap_s:.0f} ms"
        yield "missing, repeated", f"{timing.missing_share:.1%}, {timing.repeated_share:.1%} of the pictures"
    else:
        yield "rate", f"{findings.fps:.4g} frames/s"
    if (light := findings.light) is not None:
        yield "brightness", f"{light.brightness:.0f} of 255; 5 % are above {light.bright:.0f}"
        yield "black, white", f"{light.black_share:.1%}, {light.white_share:.1%} of the picture"
        yield "noise", f"{light.noise:.1f} grey levels"
    if (flicker := findings.flicker) is not None:
        yield "flicker", f"{flicker.whole:.1%} of the light at {flicker.whole_hz:.1f} Hz; bands {flicker.bands:.1%}"
    if (shake := findings.shake) is not None and shake.px is not None:
        yield "shake", f"{shake.px:.2f} px between pictures; {shake.drift_px:.1f} px from first to last"
    if findings.blockiness is not None:
        yield "compression", f"steps at blocks {findings.blockiness:.2f} times those elsewhere"
    if (objects := findings.objects) is not None:
        yield "driving", f"{objects.tracks} tracks, {objects.missed} small ones missed"
        if objects.median_px is not None:
            yield "their size", f"median {objects.median_px:.0f} px, one in ten below {objects.smallest_px:.0f} px"
        yield "least size", f"{objects.least_px:.1f} px can be seen"
        yield "in motion", f"{objects.motion_share:.1%} of the picture; {objects.restless_share:.1%} going nowhere"
    if (speed := findings.speed) is not None:
        decoding = "" if speed.decode_s is None else f"{1e3 * speed.decode_s:.1f} ms to decode, "
        yield "this machine", f"{decoding}{1e3 * speed.track_s:.1f} ms to track: {speed.rate:.0f} frames/s"
