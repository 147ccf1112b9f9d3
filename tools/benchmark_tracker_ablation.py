"""What each heuristic of the tracker is worth: all of them, then one at a time left out, on all video with truth.

    VIDTRACK_DATA=... python tools/benchmark_tracker_ablation.py --clips DIR [--only NAME ...] [--seeds 5]

Columns: crossings (hit/missed/false) pooled over the development clips, and over their variants
(benchmark_video_variants.py), MOTA / IDF1 of CDnet highway, CDnet traffic and PETS09, and the mean IDF1 of the
simulated junction at IoU 0.3, standing and under a shake of 1 px.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from benchmark_video import add_options, data_folder, mean_idf1
from score_events import Judged, judge
from video_clips import DEVELOPMENT, Clip, simulated, with_events, with_identities
from video_trackers import Ours
from video_variants import VARIANTS, derive

from vidtrack import score

WITHOUT: dict[str, tuple[str, ...]] = {
    "everything": (),
    "no cuts at necks": ("blobs.cut=false",),
    "no division among predicted boxes": ("blobs.divide=false",),
    "no pieces joined by size": ("blobs.pieces=false",),
    "no occlusion model": ("tracker.merged_blobs=false",),
    "nothing kept by overlap": ("tracker.blob_overlap=1",),
    "no restless map": ("tracker.restless=false",),
    "idle tracks stay": ("tracker.idle_s=none",),
    "no travel to be confirmed": ("tracker.confirm_travel=0",),
    "confirmed by hits and travel alone": ("tracker.confirm_s=0",),
    "coasting for 1 s": ("tracker.coast_s=1",),
    "hidden no longer than coasting": ("tracker.hidden_s=0.6",),
    "looks do not count": ("tracker.look=false",),
    "tracks are not relieved at the border": ("tracker.relieve=false",),
    "parts of vehicles stay tracks": ("tracker.parts=false",),
    "boxes not smoothed": ("tracker.box_s=0.001",),
    "pieces not linked by weak foreground": ("detector.disturbance.weak=1",),
    "what is dark amid a vehicle is vehicle": ("detector.disturbance.amid=true",),
    "dark vehicles may be shadow": ("detector.disturbance.dark=false",),
    "one threshold for all contrasts": ("detector.disturbance.contrast=false",),
    "standing things stay for 20 s": ("detector.disturbance.steady_s=20",),
    "no registration": ("detector.disturbance.registration=false",),
}
SHAKES = (0.0, 1.0)


def main() -> None:
    """Print the table, row by row."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    add_options(parser, peers=False)
    parser.add_argument("--only", nargs="+", choices=WITHOUT, default=list(WITHOUT), metavar="NAME")
    parser.add_argument("--variants", nargs="*", choices=VARIANTS, default=list(VARIANTS), metavar="NAME")
    parser.add_argument("--seeds", type=int, default=5, metavar="N", help="junctions of each shake (default 5)")
    options = parser.parse_args()
    data = data_folder(parser)
    clips = [with_events(name, data) for name in DEVELOPMENT]
    derived = [derive(clip, name, options.clips) for name in options.variants for clip in clips]
    junctions = {f"shake {shake:g}": _junctions(options.clips, shake, options.seeds) for shake in SHAKES}
    columns = ["", "clips", "variants", *with_identities(data), *junctions]
    print(f"| {' | '.join(columns)} |\n|{'---|' * len(columns)}", flush=True)
    for name in options.only:
        run = Ours([*options.assignments, *WITHOUT[name]])
        cells = [str(_pooled(clips, run)), str(_pooled(derived, run))]
        cells += [_identities(clip, run) for clip in with_identities(data).values()]
        cells += [mean_idf1(drawn, {"": run})[""] for drawn in junctions.values()]
        print(f"| {' | '.join([name, *cells])} |", flush=True)


def _junctions(folder: Path, shake: float, seeds: int) -> list[Clip]:
    return simulated(folder, f"shake-{shake:g}", range(seeds), shake=shake)


def _pooled(clips: list[Clip], run: Ours) -> Judged:
    """Crossings of all clips."""
    judged = (judge(result.counts, clip.events) for clip, result in zip(clips, run(clips), strict=True))
    return sum(judged, Judged())


def _identities(clip: Clip, run: Ours) -> str:
    scores = score.evaluate(*clip.scored(next(run([clip])).tracks))
    return f"{scores['mota']:.3f} / {scores['idf1']:.3f}"


if __name__ == "__main__":
    main()
