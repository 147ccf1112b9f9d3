"""`vidtrack simulate`: draw a traffic video whose truth is known exactly."""

from __future__ import annotations

import sys
from pathlib import Path

import click

SCENARIOS = ("crossing", "crossing-45", "nine", "junction")


class _Size(click.ParamType):
    """WIDTHxHEIGHT in pixels."""

    name = "WxH"

    def convert(
        self, value: object, param: click.Parameter | None, ctx: click.Context | None
    ) -> tuple[int, int] | None:
        width, _, height = str(value).lower().partition("x")
        if not (width.isdecimal() and height.isdecimal()):
            self.fail(f"{value!r} is not a size such as 1280x720", param, ctx)
        return int(width), int(height)


@click.command(
    name="simulate",
    short_help="Draw a traffic video with exact truth.",
    epilog="""\b
Examples:
  vidtrack simulate junction -o junction
  vidtrack simulate crossing-45 -o crossing --seed 7 --fps 25
  vidtrack simulate junction -o hard --size 1280x720 --noise 5 --shake 1.5 --light-steps 2""",
)
@click.argument("scenario", type=click.Choice(SCENARIOS))
@click.option("-o", "--output", type=click.Path(path_type=Path), help="Folder to write.  [default: runs/SCENARIO]")
@click.option("--seed", default=0, show_default=True, help="The same seed gives the same video.")
@click.option("--fps", type=float, help="Frames/s; motion per second stays.  [default: 15]")
@click.option("--size", type=_Size(), help="The same scene at this size.  [default: 320x240, junction 240x180]")
@click.option("--noise", default=2.0, show_default=True, help="Sensor noise, standard deviation in grey levels.")
@click.option("--shake", default=0.0, show_default=True, help="Camera shake, standard deviation in px.")
@click.option("--light-steps", default=0, show_default=True, help="Sudden changes of the exposure.")
@click.option("--force", is_flag=True, help="Write into a folder that is not empty.")
@click.option("--quiet", is_flag=True, help="No progress bar.")
def command(
    scenario: str,
    output: Path | None,
    seed: int,
    fps: float | None,
    size: tuple[int, int] | None,
    noise: float,
    shake: float,
    light_steps: int,
    force: bool,
    quiet: bool,
) -> None:
    """Draw SCENARIO and write video.avi and gt.txt (MOTChallenge form, visibility in column 9).

    \b
    crossing     two vehicles cross in mid-picture and are one blob for half a second or more
    crossing-45  the same, turned by 45 degrees
    nine         nine vehicles cross on an open yard
    junction     a T-junction: people, a motorcycle, cars, a lorry; 14 targets in 17 s
    """
    from vidtrack.output.folder import open_run
    from vidtrack.simulate import simulate, write

    clip = simulate(scenario, seed=seed, fps=fps, size=size, noise=noise, shake=shake, light_steps=light_steps)
    folder = open_run(output, scenario, force)
    with click.progressbar(clip, length=len(clip), label=str(folder), file=sys.stderr, hidden=quiet) as frames:
        write(clip, folder, frames)
