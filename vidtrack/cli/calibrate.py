"""`vidtrack calibrate`: the accuracy of a site's calibration."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from vidtrack.cli.json_file import deliver, json_option
from vidtrack.cli.options import Options, common, receives, start_log

if TYPE_CHECKING:
    from vidtrack.traffic.calibration.account import Account
    from vidtrack.traffic.site import Site
    from vidtrack.video.frame import Image


@dataclass(frozen=True, kw_only=True)
class CalibrateOptions(Options):
    """Options of `vidtrack calibrate`."""

    site: Path
    picture: str | None
    run: tuple[str, ...]
    json_to: str | None


@click.command(
    name="calibrate",
    epilog="""\b
Examples:
  vidtrack calibrate site.toml
  vidtrack calibrate site.toml --picture traffic.mp4 -o check
  vidtrack calibrate site.toml --run runs/traffic
  vidtrack calibrate site.toml --json -""",
)
@click.argument("site", type=click.Path(path_type=Path))
@common("Folder for calibration.png and calibration.json.  [default: only printed]")
@json_option
@click.option("--picture", metavar="IMAGE|VIDEO", help="Draw a grid of metres over this, or over its first picture.")
@click.option("--run", multiple=True, metavar="RUN", help="Also ask the traffic of this run: sizes, straight paths.")
@receives(CalibrateOptions)
def command(options: CalibrateOptions) -> int:
    """Check the calibration in SITE, a site.toml.

    Prints how far each point is from where the fit puts it, and from where the other points alone put it; what a
    pixel is worth in metres, near and far; and how wrong speeds are by the calibration.

    With --run also what the traffic says: how large its vehicles come out, whether the lanes of a road converge, and
    whether straight paths bend as by a lens.

    The exit code is 1 when the points contradict each other, or camera_height_m or the traffic contradicts them.
    """
    from vidtrack.errors import ConfigError
    from vidtrack.output.folder import open_folder
    from vidtrack.traffic.calibration.account import examined
    from vidtrack.traffic.calibration.sections import section_doubts
    from vidtrack.traffic.measures.by_traffic import by_traffic
    from vidtrack.traffic.measures.doubts import doubts
    from vidtrack.traffic.site import read_site

    start_log(options.verbose, options.quiet)
    drawn = read_site(options.site)
    if drawn.calibration is None:
        raise ConfigError(f"{options.site} has no section [calibration]; give it points, picture and ground")
    background = None if options.picture is None else first_picture(options.picture)
    if background is not None:
        drawn = drawn.scaled(background.shape[1], background.shape[0])
    result = examined(drawn)
    result.report["warnings"] += section_doubts(drawn, result.ground)
    against = []
    if options.run:
        result.report["traffic"] = told = by_traffic(options.run, drawn)
        against = doubts(told)
        result.report["warnings"] += against
    folder = None
    if options.output is not None or background is not None:
        folder = open_folder(options.output, options.site.stem, options.force)
        _draw(folder, drawn, background, result)
    if deliver(result.report, options.json_to, folder and folder / "calibration.json", options.quiet):
        _print(result.report)
    if folder is not None:
        click.echo(folder)
    contradicted = bool(result.report["contradiction"] or against)
    if contradicted and options.quiet:
        click.echo(f"vidtrack: {options.site}: {'; '.join(result.report['warnings'])}", err=True)
    return int(contradicted)


def first_picture(source: str) -> Image:
    """(H, W, 3) an image, or the first frame of a video."""
    from vidtrack.config.settings import SourceSettings
    from vidtrack.video.source import open_source

    with open_source(source, SourceSettings()) as frames:
        return next(frames).bgr()


def _draw(folder: Path, site: Site, picture: Image | None, result: Account) -> None:
    import numpy as np

    from vidtrack.output.road_grid import draw_grid

    if picture is None:
        picture = np.full((site.camera.height, site.camera.width, 3), 90, np.uint8)
    result.report["grid_m"] = draw_grid(
        folder / "calibration.png", picture, result.ground, result.picture, result.fitted
    )


def _print(report: dict[str, Any]) -> None:
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table

    from vidtrack.traffic.measures.doubts import sayings

    console = Console()
    if report["pairs"]:
        table = Table("pair", "picture px", "ground m", "off px", "off m", "without it px", "without it m", "d2")
        for column in table.columns[3:]:
            column.justify = "right"
        for i, pair in enumerate(report["pairs"], start=1):
            numbers = [pair[name] for name in ("residual_px", "residual_m", "without_px", "without_m", "d2")]
            cells = ["" if number is None else f"{number:.2f}" for number in numbers]
            at = [f"{x:.1f}, {y:.1f}" for x, y in (pair["picture"], pair["ground"])]
            table.add_row(f"{i}{' wrong' if i in report['wrong'] else ''}", *at, *cells)
        console.print(table)
    table = Table("place", "picture px", "a pixel away m", "across m", "position by calibration m", "speed by it %")
    for place in report["places"]:
        numbers = [place[name] for name in ("m_per_px_away", "m_per_px_across", "position_sigma_m")]
        x, y = place["picture_px"]
        cells = [f"{number:.3f}" for number in numbers]
        table.add_row(place["where"], f"{x:g}, {y:g}", *cells, _number(place["speed_sigma_percent"]))
    console.print(table)
    camera = report["camera"]
    if camera is None:
        console.print(
            "The focal length cannot be told from these points; give focal_px for the speed of high vehicles."
        )
    else:
        console.print(
            f"The camera is {camera['height_m']:.2f} m above the road (standard deviation "
            f"{_number(camera['height_sigma_m'])} m); its focal length is {camera['focal_px']:.0f} px."
        )
    lens = report["lens"]
    if lens is not None:
        by_points = f" (standard deviation {lens['corner_sigma_px']:.1f} px)" if lens["k1_sigma"] else ""
        console.print(
            f"The lens moves the farthest corner of the picture by {lens['corner_px']:+.1f} px{by_points}: k1 = "
            f"{lens['k1']:.3f}, k2 = {lens['k2']:.3f}."
        )
    if "traffic" in report:
        for saying in sayings(report["traffic"]):
            console.print(f"{saying.found[0].upper()}{saying.found[1:]}.")
    for line in report["warnings"]:
        console.print(f"[bold]Note:[/bold] {escape(line)}")


def _number(value: float | None) -> str:
    return "not known" if value is None else f"{value:.2f}"
