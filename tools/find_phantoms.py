"""Candidates for phantoms on the clips of a steady camera: tracks that last and go nowhere.

    VIDTRACK_DATA=... python tools/find_phantoms.py [--pictures DIR] [--set KEY=VALUE ...]

A candidate lasts two seconds or more and is never 1.5 of its sizes from where it began. It may be a vehicle or a person
that stands, so the number a minute is an upper bound of the phantoms; --pictures writes a sheet for each, its box in
six pictures, to look at. Sheets are written of clips whose single events may be looked at.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from pathlib import Path

import cv2
import numpy as np
from benchmark_video import data_folder
from numpy.typing import NDArray
from video_clips import DEVELOPMENT, Clip, with_events, with_identities
from video_trackers import contenders

from vidtrack.formats import Table

STEADY = ("street", "tunnel", "motorway", "dual_carriageway", "haze", "highway", "pets")
LOOKED_AT = (*DEVELOPMENT, "highway", "pets")
LASTS_S, NEAR = 2.0, 1.5
TILES, SIDE, MARGIN = 6, 240, 2.0  # of a sheet; pictures, px, and box sizes shown


def main() -> None:
    """Print a line a clip, and one for all."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--pictures", type=Path, metavar="DIR", help="folder for the sheets")
    parser.add_argument("--set", dest="assignments", action="append", default=[], metavar="KEY=VALUE")
    options = parser.parse_args()
    data = data_folder(parser)
    clips = with_identities(data) | {
        name: with_events(name, data) for name in STEADY if name not in ("highway", "pets")
    }
    track = contenders(options.assignments, None)["vidtrack"]
    minutes, total = 0.0, 0
    print("| clip | minutes | candidates | tracks |\n|---|---|---|---|")
    for name in STEADY:
        tracks = next(track([clips[name]])).tracks
        fps, count = rate_and_length(clips[name])
        found = list(candidates(tracks, LASTS_S * fps))
        print(f"| {name} | {count / fps / 60:.2f} | {len(found)} | {', '.join(map(str, found))} |", flush=True)
        minutes, total = minutes + count / fps / 60, total + len(found)
        if options.pictures and name in LOOKED_AT:
            options.pictures.mkdir(parents=True, exist_ok=True)
            for one in found:
                cv2.imwrite(str(options.pictures / f"{name}-{one}.png"), sheet(clips[name], tracks, one))
    print(f"| all | {minutes:.2f} | {total}, {total / minutes:.1f} a minute | |")


def candidates(tracks: Table, least_frames: float) -> Iterator[int]:
    """Tracks that last and stay where they began."""
    for one in np.unique(tracks.id):
        rows = tracks.select(tracks.id == one)
        away = np.hypot(*(rows.xy - rows.xy[0]).T)
        if np.ptp(rows.frame) >= least_frames and away.max() < NEAR * np.median(rows.box[:, 2:].max(axis=1)):
            yield int(one)


def rate_and_length(clip: Clip) -> tuple[float, int]:
    """Frames/s and number of frames."""
    if clip.video.is_dir():
        assert clip.fps is not None  # a folder of pictures has none of its own
        return clip.fps, len(list(clip.video.glob("*.jpg")))
    video = cv2.VideoCapture(str(clip.video))
    return video.get(cv2.CAP_PROP_FPS), int(video.get(cv2.CAP_PROP_FRAME_COUNT))


def sheet(clip: Clip, tracks: Table, one: int) -> NDArray[np.uint8]:
    """A track's box in pictures from its first to its last."""
    rows = tracks.select(tracks.id == one)
    chosen = np.unique(np.linspace(0, len(rows.frame) - 1, TILES).astype(int))
    wanted = {int(rows.frame[k]): rows.box[k] for k in chosen}
    video = cv2.VideoCapture(str(clip.video / "in%06d.jpg" if clip.video.is_dir() else clip.video))
    tiles = []
    for frame in range(max(wanted) + 1):
        seen, picture = video.read()
        if seen and frame in wanted:
            tiles.append(_tile(picture, wanted[frame]))
    return np.hstack(tiles)


def _tile(picture: NDArray[np.uint8], box: NDArray) -> NDArray[np.uint8]:
    """The box and what is about it, inside the picture."""
    h, w = picture.shape[:2]
    side = min(MARGIN * max(box[2], box[3]), h, w)
    left = float(np.clip(box[0] + box[2] / 2 - side / 2, 0, w - side))
    top = float(np.clip(box[1] + box[3] / 2 - side / 2, 0, h - side))
    part = picture[int(top) : int(top + side), int(left) : int(left + side)]
    zoom = SIDE / max(part.shape[:2])
    tile = cv2.resize(part, (SIDE, SIDE), interpolation=cv2.INTER_CUBIC)
    first = int((box[0] - left) * zoom), int((box[1] - top) * zoom)
    last = int((box[0] + box[2] - left) * zoom), int((box[1] + box[3] - top) * zoom)
    cv2.rectangle(tile, first, last, (0, 0, 255), 1)
    return np.asarray(tile, np.uint8)


if __name__ == "__main__":
    main()
