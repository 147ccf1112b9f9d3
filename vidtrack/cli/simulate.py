"""`vidtrack simulate`: a traffic video or radar plots with exact truth."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import click

from vidtrack.cli.options import Options, common, receives, seed_option, start_log
from vidtrack.cli.radar_problem import weibull_option

if TYPE_CHECKING:
    from vidtrack.amplitude.densities import Weibull

VIDEO = ("crossing", "crossing-45", "nine", "junction")
ROADS = ("road", "junction-3d", "roundabout", "motorway")
RADAR = (
    "radar-tws",
    "radar-uneven",
    "radar-incoming",
    "radar-altitude",
    "radar-speed",
    "radar-crossing",
    "radar-unresolved",
    "radar-parting",
    "radar-weaving",
)
NETWORK = ("radar-network",)
PICTURE = ("fps", "size", "noise", "shake", "light_steps", "weather", "light", "wet", "clock")
WEATHER = ("clear", "rain", "snow", "fog")
LIGHT = ("day", "low-sun", "dusk", "night")
OPTIONS = {
    VIDEO: (*PICTURE, "leaves"),
    ROADS: (*PICTURE, "seconds", "flow", "camera_height", "tilt_deg", "lens", "click_sigma", "radar"),
    RADAR: ("snr_db", "pfa", "weibull", "glint"),
    NETWORK: ("bias",),
}
"""The options of each kind of scenario."""


class _Bias(click.ParamType):
    """RANGE_M,AZIMUTH_DEG,TIME_S."""

    name = "M,DEG,S"

    def convert(
        self, value: object, param: click.Parameter | None, ctx: click.Context | None
    ) -> tuple[float, float, float]:
        parts = value if isinstance(value, tuple) else str(value).split(",")
        try:
            metres, degrees, seconds = (float(part) for part in parts)
        except ValueError:
            self.fail(f"{value!r} is not three numbers such as 100,1,0", param, ctx)
        return metres, degrees, seconds


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


@dataclass(frozen=True, kw_only=True)
class SimulateOptions(Options):
    """Options of `vidtrack simulate`."""

    scenario: str
    seed: int
    fps: float | None
    size: tuple[int, int] | None
    noise: float
    shake: float
    light_steps: int
    weather: str
    light: str
    wet: bool
    leaves: float
    clock: bool
    seconds: float | None
    flow: float | None
    camera_height: float
    tilt_deg: float | None
    lens: float
    click_sigma: float
    radar: bool
    snr_db: float | None
    pfa: float | None
    weibull: Weibull | None
    glint: float | None
    bias: tuple[float, float, float]

    def chosen(self, names: tuple[str, ...]) -> dict[str, Any]:
        """The values of these options."""
        return {name: getattr(self, name) for name in names}


@click.command(
    name="simulate",
    epilog="""\b
Examples:
  vidtrack simulate junction -o junction
  vidtrack simulate crossing-45 -o crossing --seed 7 --fps 25
  vidtrack simulate junction -o hard --size 1280x720 --noise 5 --shake 1.5 --light-steps 2
  vidtrack simulate junction -o rainy-night --weather rain --light night --clock
  vidtrack simulate junction-3d -o crossroads --seconds 120 --flow 1200 --lens -0.15
  vidtrack simulate radar-tws -o tws --seed 3 --snr-db 16
  vidtrack simulate radar-network -o network --bias 100,1,0.5""",
)
@click.argument("scenario", type=click.Choice(VIDEO + ROADS + RADAR + NETWORK), metavar="SCENARIO")
@common("Folder to write.  [default: runs/SCENARIO]")
@seed_option
@click.option("--fps", type=float, help="Frames/s; motion per second stays.  [default: 15, roads 25]")
@click.option(
    "--size", type=_Size(), help="The same scene at this size.  [default: 320x240, junction 240x180, roads 1280x720]"
)
@click.option("--noise", default=2.0, show_default=True, help="Sensor noise, standard deviation in grey levels.")
@click.option("--shake", default=0.0, show_default=True, help="Camera shake, standard deviation in px.")
@click.option("--light-steps", default=0, show_default=True, help="Sudden changes of the exposure.")
@click.option("--weather", type=click.Choice(WEATHER), default="clear", show_default=True, help="Rain wets the road.")
@click.option(
    "--light",
    type=click.Choice(LIGHT),
    default="day",
    show_default=True,
    help="Dusk and night: vehicles have lamps on.",
)
@click.option("--wet", is_flag=True, help="A wet road that mirrors vehicles and lamps.")
@click.option("--leaves", default=1.0, show_default=True, help="How far the tree's leaves swing, a factor.")
@click.option("--clock", is_flag=True, help="Burn a running clock into the picture.")
@click.option("--seconds", type=float, help="Roads: length of the video.  [default: 60]")
@click.option("--flow", type=float, help="Roads: vehicles/h in all.  [default: the scenario's]")
@click.option("--camera-height", type=float, default=8.0, show_default=True, help="Roads: m above the road.")
@click.option("--tilt-deg", type=float, help="Roads: camera's axis below the horizon.  [default: the scenario's]")
@click.option("--lens", default=0.0, show_default=True, help="Roads: k1 of Brown-Conrady, -0.3 to 0.3; barrel below 0.")
@click.option("--click-sigma", default=1.0, show_default=True, help="Roads: error of clicked points in site.toml, px.")
@click.option("--radar", is_flag=True, help="Roads: also the plots of a traffic radar, as radar.csv and radars.toml.")
@click.option("--snr-db", type=float, help="Radar: mean signal to noise ratio of a target.  [default: the scenario's]")
@click.option(
    "--pfa", type=click.FloatRange(0, 0.1), help="Radar: false alarms per resolution cell.  [default: the scenario's]"
)
@weibull_option
@click.option("--glint", type=click.FloatRange(0, 1), help="Radar: share of errors that are five times as large.")
@click.option(
    "--bias",
    type=_Bias(),
    default=(0.0, 1.0, 0.0),
    help="Radar-network: what the second radar measures too much, in m, degrees and s.  [default: 0,1,0]",
)
@receives(SimulateOptions)
def command(options: SimulateOptions) -> None:
    """Draw SCENARIO: a video as video.avi and gt.txt (MOTChallenge form, visibility in column 9), a road with
    site.toml, road_truth.csv and road_events.csv besides, a radar scenario as plots.csv and truth.csv, a network of
    radars as north.csv, south.csv, radars.toml and truth.csv.

    \b
    crossing     two vehicles cross in mid-picture and are one blob for half a second or more
    crossing-45  the same, turned by 45 degrees
    nine         nine vehicles cross on an open yard
    junction     a T-junction: people, a motorcycle, cars, a lorry; 14 targets in 17 s

    \b
    road         a street with a signal at a pedestrian crossing, in perspective
    junction-3d  a crossroads with a major road, in perspective
    roundabout   a compact roundabout with four legs, in perspective
    motorway     two carriageways of three lanes, in perspective

    \b
    radar-tws         track while scan: eight aircraft, two of them turn with 2.5 g, Weibull clutter
    radar-uneven      the same in Rayleigh clutter, with two patches of land: 37 false plots a scan
    radar-incoming    one aircraft comes in, seen 7.7 times a second in range, azimuth and elevation
    radar-altitude    the same, its altitude swings by 300 m
    radar-speed       the same, it accelerates with 2.5 g from 200 to 350 m/s
    radar-crossing    two aircraft cross at a small angle in clutter
    radar-unresolved  two aircraft fly in one resolution cell for 80 s or more: one plot for both
    radar-parting     the same for 10 to 90 s, and half of the pairs have crossed when they part
    radar-weaving     four aircraft weave from side to side all the time, with 1 to 4 g
    radar-network     two radars 30 km apart see two aircraft; the second one's azimuths are 1 degree too large
    """
    start_log(options.verbose, options.quiet)
    scenarios = next(kind for kind in OPTIONS if options.scenario in kind)
    _refuse_others_than(OPTIONS[scenarios], options.scenario)
    if scenarios is RADAR:
        _draw_plots(options)
    elif scenarios is NETWORK:
        _draw_network(options)
    else:
        _draw_video(options, options.chosen(OPTIONS[scenarios]))


def _draw_video(options: SimulateOptions, conditions: dict[str, Any]) -> None:
    from vidtrack.output.folder import open_folder
    from vidtrack.simulate import simulate, simulate_road, write, write_road
    from vidtrack.simulate.roads.radar import write_road_plots

    if options.scenario in ROADS:
        conditions.pop("radar")
        road = simulate_road(options.scenario, seed=options.seed, **conditions)
        frames, count, save = iter(road), len(road), partial(write_road, road)
    else:
        flat = simulate(options.scenario, seed=options.seed, **conditions)
        frames, count, save = iter(flat), len(flat), partial(write, flat)
    folder = open_folder(options.output, options.scenario, options.force)
    with click.progressbar(frames, length=count, label=str(folder), file=sys.stderr, hidden=options.quiet) as shown:
        save(folder, shown)
    if options.radar:
        write_road_plots(folder, road)


def _draw_plots(options: SimulateOptions) -> None:
    from vidtrack.output.folder import open_folder
    from vidtrack.simulate.radar_scenarios import simulate_radar
    from vidtrack.simulate.radar_write import write_radar

    seen = simulate_radar(
        options.scenario,
        options.seed,
        snr_db=options.snr_db,
        p_fa=options.pfa,
        clutter=options.weibull,
        glint=options.glint,
    )
    write_radar(seen, open_folder(options.output, options.scenario, options.force))


def _draw_network(options: SimulateOptions) -> None:
    from vidtrack.output.folder import open_folder
    from vidtrack.simulate.radar_network import simulate_network, write_network

    write_network(
        simulate_network(options.seed, bias=options.bias), open_folder(options.output, options.scenario, options.force)
    )


def _refuse_others_than(options: tuple[str, ...], scenario: str) -> None:
    """Raise an error for an option that the scenario's kind does not have."""
    context = click.get_current_context()
    for name in sorted({name for kind in OPTIONS.values() for name in kind} - set(options)):
        if context.get_parameter_source(name) is click.core.ParameterSource.COMMANDLINE:
            raise click.UsageError(f"--{name.replace('_', '-')} does nothing for {scenario}; leave it out")
