"""The clips of the video benchmarks: files, counting lines and truth below VIDTRACK_DATA, and simulated ones."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import score_highway
from numpy.typing import NDArray
from road_lines import crossings, leg_lines
from score_events import Event, read_truth

from vidtrack import formats
from vidtrack.formats import Table
from vidtrack.simulate import simulate, simulate_road, write, write_road

DEVELOPMENT = ("street", "handheld", "tunnel")
"""Clips whose single events may be looked at; the others are kept aside, and only their totals are printed."""

FILES = {
    "street": ("street.mp4", ("x320:320,0,320,360",)),
    "handheld": ("handheld.mp4", ("a:230,300,620,300",)),
    "tunnel": ("tunnel.mp4", ("left:150,140,150,245", "right:425,250,580,250")),
    "motorway": ("motorway.avi", ("away:60,150,290,150", "towards:0,75,190,75")),
    "uab_road": ("uab_road.avi", ("a:150,160,470,160",)),
    "dual_carriageway": ("dual_carriageway.mp4", ("near:190,280,480,280", "far:200,110,200,235")),
    "haze": ("haze.mp4", ("a:55,190,180,190",)),
}
CROSSED = {
    "highway": ("a:0,170,215,170", ("down",)),
    "traffic": ("a:40,120,319,120", ("up",)),
    "pets": ("a:400,150,400,570", ("left", "right")),
}
"""Lines across the clips whose truth is boxes with identities, and the ways that are driven or walked over them."""
TRAFFIC_FIRST, TRAFFIC_LAST = 900, 1235  # image numbers with truth
_KNOWN = {"highway": (score_highway.FIRST, score_highway.LAST), "traffic": (TRAFFIC_FIRST, TRAFFIC_LAST)}
_BY_BOXES = 9.0  # frames; tolerance of a crossing of the true boxes' centres


def everything(result: Table, truth: Table) -> Table:
    """All rows of a result count."""
    return result


def of_traffic(result: Table, truth: Table) -> Table:
    """The rows of CDnet traffic that have truth."""
    image = result.frame + 1
    return result.select((image >= TRAFFIC_FIRST) & (image <= TRAFFIC_LAST))


def of_highway(result: Table, truth: Table) -> Table:
    """The rows of CDnet highway that count."""
    return score_highway.judged(result, truth, 0.5)


@dataclass(frozen=True)
class Clip:
    """A video with its truth.

    video   file, or a folder of pictures in%06d.jpg
    lines   counted lines, NAME:x1,y1,x2,y2
    events  crossings of these lines
    known   first and last frame for which crossings are known; those that are counted elsewhere are left out
    truth   MOT file
    fps     to be told where the video has no rate
    judged  the rows of a result that are scored
    masked  the masks are wanted too
    """

    name: str
    video: Path
    lines: tuple[str, ...] = ()
    events: tuple[Event, ...] = ()
    known: tuple[float, float] = (0.0, np.inf)
    truth: Path | None = None
    fps: float | None = None
    judged: Callable[[Table, Table], Table] = field(default=everything, repr=False)
    masked: bool = False

    def scored(self, result: Table) -> tuple[Table, Table]:
        """Result and truth as they are compared."""
        assert self.truth is not None  # or there is nothing to compare with
        truth = formats.read(self.truth)
        return self.judged(result, truth), truth


def with_events(name: str, data: Path) -> Clip:
    """A clip whose crossings were found by eye."""
    file, lines = FILES[name]
    return Clip(name, data / file, lines, tuple(read_truth(data / "events" / f"{name}.csv")))


def with_identities(data: Path) -> dict[str, Clip]:
    """The clips whose truth is boxes with identities."""
    traffic, highway, pets = data / "cdnet_traffic", data / "highway", data / "pets09"
    return {
        "traffic": Clip("traffic", traffic / "video.avi", truth=traffic / "gt_ids.txt", judged=of_traffic, masked=True),
        "highway": Clip("highway", highway / "input", truth=highway / "gt_ids.txt", fps=25, judged=of_highway),
        "pets": Clip("pets", pets / "video.avi", truth=pets / "gt.txt"),
    }


def with_crossings(name: str, data: Path) -> Clip:
    """A clip whose truth is boxes with identities, and the crossings of a line by their centres."""
    clip, (line, ways) = with_identities(data)[name], CROSSED[name]
    assert clip.truth is not None
    label, ends = read_line(line)
    events = (replace(event, tolerance=_BY_BOXES) for event in crossings(clip.truth, {label: ends}))
    first, last = _KNOWN.get(name, (1.0, np.inf))
    known = tuple(event for event in events if event.direction in ways)
    return replace(clip, lines=(line,), events=known, known=(first - 1, last - 1), masked=False)


def read_line(text: str) -> tuple[str, NDArray]:
    """Name and (2, 2) ends of a line NAME:x1,y1,x2,y2."""
    name, _, numbers = text.rpartition(":")
    return name, np.array([float(number) for number in numbers.split(",")]).reshape(2, 2)


def simulated(folder: Path, label: str, seeds: Iterable[int], **knobs: Any) -> list[Clip]:
    """The simulated junction, drawn into `folder` where it is not there yet; `label` tells the knobs apart."""

    def draw(place: Path, seed: int) -> None:
        write(simulate("junction", seed=seed, **knobs), place)

    return [_drawn(folder, f"junction-{label}", seed, draw, last="gt.txt") for seed in seeds]


def simulated_road(folder: Path, road: str, label: str, seeds: Iterable[int], **knobs: Any) -> list[Clip]:
    """A simulated road in perspective, drawn into `folder` where it is not there yet; `label` tells the knobs apart."""

    def draw(place: Path, seed: int) -> None:
        write_road(simulate_road(road, seed=seed, **knobs), place)

    drawn = [_drawn(folder, f"{road}{label}", seed, draw, last="site.toml") for seed in seeds]
    return [with_legs(clip) for clip in drawn]


def with_legs(clip: Clip) -> Clip:
    """A simulated road whose legs are counted."""
    assert clip.truth is not None
    lines = leg_lines(clip.video.parent / "site.toml")
    told = tuple(f"{leg}:{','.join(f'{value:g}' for value in ends.ravel())}" for leg, ends in lines.items())
    return replace(clip, lines=told, events=tuple(crossings(clip.truth, lines)))


def _drawn(folder: Path, label: str, seed: int, draw: Callable[[Path, int], None], last: str) -> Clip:
    """A clip that `draw` writes, unless `last`, the file it writes last, is there."""
    name = f"{label}-{seed}"
    place = folder / name
    if not (place / last).is_file():
        place.mkdir(parents=True, exist_ok=True)
        draw(place, seed)
    return Clip(name, place / "video.avi", truth=place / "gt.txt")
