"""One table of what is measured on video, with two scripts that a user would write in an hour beside.

    VIDTRACK_DATA=... python tools/benchmark_video.py --clips DIR [--peers-in DIR] [--rows NAME ...] [--set KEY=VALUE]

Rows: clips with crossings found by eye (hit/missed/false, and pooled), CDnet traffic (F of the masks, MOTA and IDF1,
also with boxes that hold the whole vehicle),
CDnet highway and PETS09 (MOTA, IDF1, switches), the simulated junction under shake and in weather (mean IDF1 at IoU
0.3; four times the shake at 960x720), roads in perspective (crossings of their legs, mean MOTA and IDF1; the first
seeds), and roads in rain, snow, fog, low sun, dusk and night (crossings).
vidtrack runs with its defaults but for --set. The scripts are MOG2 with SORT and
KNN with ByteTrack (peers/count_lines.py) in an environment that pip makes in --peers-in, where their results are kept
too; without --peers-in they are left out. The junctions are drawn once into --clips.
"""

from __future__ import annotations

import argparse
import os
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from statistics import mean

import cv2
from benchmark_background import f_measure
from score_events import Judged, judge
from video_clips import (
    DEVELOPMENT,
    FILES,
    TRAFFIC_FIRST,
    TRAFFIC_LAST,
    Clip,
    simulated,
    simulated_road,
    with_events,
    with_identities,
)
from video_trackers import Contender, Tracked, contenders
from whole_boxes import whole

from vidtrack import score
from vidtrack.formats import Table

SHAKES = (0.0, 0.3, 1.0, 2.0, 4.0)
LARGE = (960, 720)
LOOSE = 0.3  # IoU for the simulated junction, whose people are six pixels wide
ROADS = ("road", "junction-3d", "roundabout", "motorway")

CONDITIONS: dict[str, dict[str, object]] = {
    "rain": {"weather": "rain"},
    "snow": {"weather": "snow"},
    "fog": {"weather": "fog"},
    "low-sun": {"light": "low-sun"},
    "dusk": {"light": "dusk"},
    "night": {"light": "night"},
    "wet-night": {"light": "night", "wet": True},
    "rainy-night": {"weather": "rain", "light": "night"},
    "leaves-4": {"leaves": 4.0},
    "clock": {"clock": True},
}

ON_ROADS = ("rain", "snow", "fog", "low-sun", "dusk", "night", "wet-night", "rainy-night", "day")
SMALL: dict[str, object] = {"size": (640, 360), "seconds": 30.0}  # the roads in these conditions

Cells = dict[str, str]
"""The text of a row for each contender."""


def main() -> None:
    """Print the table, row by row."""
    names = (*FILES, "traffic", "highway", "pets", "junction", "junction-large", "conditions", "roads", "weather")
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rows", nargs="+", choices=(*names, "events"), default=["events", *names[len(FILES) :]])
    add_options(parser)
    parser.add_argument("--seeds", type=int, default=10, metavar="N", help="junctions of each shake (default 10)")
    parser.add_argument("--road-seeds", type=int, default=2, metavar="N", help="roads of each kind (default 2)")
    parser.add_argument("--first-seed", type=int, default=0, metavar="N", help="of the roads in weather (default 0)")
    options = parser.parse_args()
    data = data_folder(parser)
    rivals = contenders(options.assignments, options.peers_in)
    print_head(rivals)
    chosen = [name for name in FILES if name in options.rows or "events" in options.rows]
    event_rows([with_events(name, data) for name in chosen], rivals, DEVELOPMENT if options.events else ())
    for name, clip in with_identities(data).items():
        if name in options.rows:
            identity_rows(clip, rivals, data)
    for name, size in (("junction", None), ("junction-large", LARGE)):
        if name in options.rows:
            junction_rows(name, size, options, rivals)
    for label, knobs in CONDITIONS.items() if "conditions" in options.rows else ():
        clips = simulated(options.clips, label, range(options.seeds), **knobs)
        print_row(label, f"IDF1, mean of {options.seeds}", mean_idf1(clips, rivals))
    for road in ROADS if "roads" in options.rows else ():
        road_rows(simulated_road(options.clips, road, "", range(options.road_seeds)), road, rivals)
    if "weather" in options.rows:
        weather_rows(options, rivals)


def add_options(parser: argparse.ArgumentParser, *, peers: bool = True) -> None:
    """The options that the video benchmarks share; those about the scripts where these take part."""
    parser.add_argument("--clips", type=Path, required=True, metavar="DIR", help="folder of clips that are made once")
    parser.add_argument("--set", dest="assignments", action="append", default=[], metavar="KEY=VALUE")
    if peers:
        parser.add_argument("--peers-in", type=Path, metavar="DIR", help="folder of the scripts' environment, results")
        parser.add_argument("--events", action="store_true", help=f"print single events of {', '.join(DEVELOPMENT)}")


def data_folder(parser: argparse.ArgumentParser) -> Path:
    """The folder of the real clips."""
    if "VIDTRACK_DATA" not in os.environ:
        parser.error("set VIDTRACK_DATA to the folder that holds the clips")
    return Path(os.environ["VIDTRACK_DATA"])


def print_head(names: Iterable[str]) -> None:
    """The first two lines of the table."""
    columns = ["row", "measure", *names]
    print(f"| {' | '.join(columns)} |\n|{'---|' * len(columns)}", flush=True)


def print_row(name: str, measure: str, cells: Cells) -> None:
    """A line of the table."""
    print(f"| {name} | {measure} | {' | '.join(cells.values())} |", flush=True)


def event_rows(clips: Sequence[Clip], rivals: dict[str, Contender], told: Iterable[str]) -> None:
    """Crossings of every clip and of all; single events of clips called `told` below the table."""
    total = {rival: Judged() for rival in rivals}
    single: list[str] = []
    for clip in clips:
        scored = {rival: judge_clip(tracked(run, clip), clip) for rival, run in rivals.items()}
        print_row(clip.name, "hit/missed/false", {rival: str(judged) for rival, judged in scored.items()})
        total = {rival: total[rival] + judged for rival, judged in scored.items()}
        if clip.name in told:
            single += told_events(clip.name, scored)
    if len(clips) > 1:
        print_row(f"{len(clips)} clips", "hit/missed/false", {rival: str(judged) for rival, judged in total.items()})
        shares = {rival: f"{judged.recall:.3f} / {judged.precision:.3f}" for rival, judged in total.items()}
        print_row(f"{len(clips)} clips", "recall / precision", shares)
    print("\n".join(["", *single, ""]) if single else "", end="", flush=True)


def judge_clip(result: Tracked, clip: Clip) -> Judged:
    """The counts of a clip, where its crossings are known."""
    first, last = clip.known
    return judge((count for count in result.counts if first <= count.frame <= last), clip.events)


def told_events(name: str, scored: dict[str, Judged]) -> Iterator[str]:
    """A line of text for each event that was missed or false."""
    for rival, judged in scored.items():
        for kind, events in (("missed", judged.missed), ("false", judged.false)):
            for event in events:
                track = "" if event.track < 0 else f", track {event.track}"
                yield f"{name}, {rival}: {kind} {event.line} {event.direction}, frame {event.frame:g}{track}"


def identity_rows(clip: Clip, rivals: dict[str, Contender], data: Path) -> None:
    """Scores against boxes with identities, and of the masks where there is truth for them."""
    results = {rival: tracked(run, clip) for rival, run in rivals.items()}
    if clip.masked:
        print_row(clip.name, "F of the masks", {rival: f"{traffic_f(r, data):.3f}" for rival, r in results.items()})
    pairs = {rival: clip.scored(result.tracks) for rival, result in results.items()}
    print_row(clip.name, "MOTA / IDF1 / switches", {rival: identity(*pair) for rival, pair in pairs.items()})
    if clip.masked:
        cells = {
            rival: identity(result, whole(truth, data / "cdnet_traffic/groundtruth", TRAFFIC_LAST))
            for rival, (result, truth) in pairs.items()
        }
        print_row(clip.name, "the same, boxes of whole vehicles", cells)


def identity(result: Table, truth: Table) -> str:
    """MOTA, IDF1 and switches."""
    scores = score.evaluate(result, truth)
    return f"{scores['mota']:.3f} / {scores['idf1']:.3f} / {scores['switches']}"


def traffic_f(result: Tracked, data: Path) -> float:
    """F of the masks of CDnet traffic, as the benchmark scores."""
    folder = data / "cdnet_traffic"
    numbers = range(TRAFFIC_FIRST, TRAFFIC_LAST + 1)
    truths = [cv2.imread(str(folder / f"groundtruth/gt{k:06d}.png"), cv2.IMREAD_GRAYSCALE) for k in numbers]
    region = cv2.imread(str(folder / "ROI.bmp"), cv2.IMREAD_GRAYSCALE) > 0
    region = region[:, : truths[0].shape[1]]  # this sequence's is wider than its pictures
    return f_measure(result.masks[TRAFFIC_FIRST - 1 : TRAFFIC_LAST], truths, region)[0]


def junction_rows(
    name: str, size: tuple[int, int] | None, options: argparse.Namespace, rivals: dict[str, Contender]
) -> None:
    """Mean IDF1 of the simulated junction for each shake, which grows with the size."""
    for shake in SHAKES:
        knobs = {"shake": shake} if size is None else {"shake": 4 * shake, "size": size}
        label = f"shake-{shake:g}" if size is None else f"shake-{4 * shake:g}-{size[0]}x{size[1]}"
        clips = simulated(options.clips, label, range(options.seeds), **knobs)
        print_row(label, f"IDF1, mean of {options.seeds}", mean_idf1(clips, rivals))


def road_rows(clips: Sequence[Clip], road: str, rivals: dict[str, Contender]) -> None:
    """Crossings of a road's legs; mean MOTA and IDF1, for boxes that fit and for boxes that are there."""
    results = {rival: list(run(clips)) for rival, run in rivals.items()}
    counted = {rival: Judged() for rival in rivals}
    for rival, found in results.items():
        for clip, result in zip(clips, found, strict=True):
            counted[rival] += judge(result.counts, clip.events)
    print_row(road, f"hit/missed/false, {len(clips)} seeds", {rival: str(judged) for rival, judged in counted.items()})
    for iou in (0.5, LOOSE):
        cells = {}
        for rival, found in results.items():
            pairs = zip(clips, found, strict=True)
            scores = [score.evaluate(*clip.scored(result.tracks), iou=iou) for clip, result in pairs]
            cells[rival] = " / ".join(f"{mean(float(one[name]) for one in scores):.3f}" for name in ("mota", "idf1"))
        print_row(road, f"MOTA / IDF1 at IoU {iou:g}, mean of {len(clips)}", cells)


def weather_rows(options: argparse.Namespace, rivals: dict[str, Contender]) -> None:
    """Crossings on roads in each weather and light, all roads in turn, and of all of them."""
    total = {rival: Judged() for rival in rivals}
    seeds = range(options.first_seed, options.first_seed + options.road_seeds)
    for place, label in enumerate(ON_ROADS):
        knobs = SMALL | CONDITIONS.get(label, {})
        clips = [
            clip
            for seed in seeds
            for clip in simulated_road(options.clips, ROADS[(place + seed) % len(ROADS)], f"-{label}", [seed], **knobs)
        ]
        counted = {rival: Judged() for rival in rivals}
        for rival, run in rivals.items():
            for clip, result in zip(clips, run(clips), strict=True):
                judged = judge(result.counts, clip.events)
                counted[rival] += judged
                if options.events:
                    print(f"{clip.name}, {rival}: {judged}")
        print_row(f"roads, {label}", f"hit/missed/false, {len(clips)} seeds", {r: str(j) for r, j in counted.items()})
        total = {rival: total[rival] + judged for rival, judged in counted.items()}
    print_row("roads, all of these", "hit/missed/false", {rival: str(judged) for rival, judged in total.items()})


def mean_idf1(clips: Sequence[Clip], rivals: dict[str, Contender]) -> Cells:
    """Each contender's mean IDF1 over simulated clips."""
    cells = {}
    for rival, run in rivals.items():
        results = zip(clips, run(clips), strict=True)
        scores = [score.evaluate(*clip.scored(result.tracks), iou=LOOSE)["idf1"] for clip, result in results]
        cells[rival] = f"{mean(map(float, scores)):.3f}"
    return cells


def tracked(run: Callable[[Sequence[Clip]], Iterator[Tracked]], clip: Clip) -> Tracked:
    """What a contender makes of one clip."""
    return next(run([clip]))


if __name__ == "__main__":
    main()
