"""The development clips changed in known ways, vidtrack beside two scripts: hit/missed/false of each.

    VIDTRACK_DATA=... python tools/benchmark_video_variants.py --clips DIR [--peers-in DIR] [--of CLIP ...]
        [--variants NAME ...] [--draws N [--first-draw K]] [--set KEY=VALUE ...] [--events]

Every 2nd and 3rd frame, half size, mirrored, backward, every picture twice, flickering light, no colour, too much
light, noise, rain, haze, dusk, snow, glare, clouds, a wandering white balance, night, coarse encoding, and a camera
that sways by 0.5, 1 and 3 px (at 640 px of width). A rule that helps a clip and hurts its variants was fitted to the
clip. With --draws each clip is changed N times by chance instead: another part of the picture, begin, size, light,
rate, noise, encoding, and mount at once. `--variants black damaged lightning knocked zoomed` are faults of the camera
after 5 s: no light or damaged pictures for 0.6 s, a flash, a knock by 8 px (at 640 px of width), a zoom by 6 %; who
crosses in the 3 s after may be counted or not. In highway, traffic and pets, whose truth is boxes, those who cross a
line by the centres of their boxes count. The clips are made once, in --clips; --peers-in and --set are those of
benchmark_video.py.
"""

from __future__ import annotations

import argparse

from benchmark_video import add_options, data_folder, event_rows, print_head
from video_clips import CROSSED, DEVELOPMENT, with_crossings, with_events
from video_trackers import contenders
from video_variants import FAULTS, VARIANTS, derive, drawn


def main() -> None:
    """Print the table, row by row."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    add_options(parser)
    parser.add_argument("--of", nargs="+", choices=[*DEVELOPMENT, *CROSSED], default=DEVELOPMENT, metavar="CLIP")
    parser.add_argument("--variants", nargs="+", choices=VARIANTS | FAULTS, default=list(VARIANTS), metavar="NAME")
    parser.add_argument("--draws", type=int, default=0, metavar="N", help="chance combinations of each clip instead")
    parser.add_argument("--first-draw", type=int, default=0, metavar="K", help="number of the first one (default 0)")
    options = parser.parse_args()
    data = data_folder(parser)
    rivals = contenders(options.assignments, options.peers_in)
    print_head(rivals)
    clips = [(with_crossings if name in CROSSED else with_events)(name, data) for name in options.of]
    derived = [derive(clip, name, options.clips) for name in options.variants for clip in clips if not options.draws]
    for seed in range(options.first_draw, options.first_draw + options.draws):
        derived += [derive(clip, f"draw-{seed}", options.clips, drawn(clip, seed)) for clip in clips]
    event_rows(derived, rivals, [clip.name for clip in derived] if options.events else ())


if __name__ == "__main__":
    main()
