"""Simulated videos for figures 5 to 9: detected once, tracked by several methods, compared with the truth."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import av
import numpy as np
from scipy.optimize import linear_sum_assignment

from vidtrack.arrays.types import Floats, Ints
from vidtrack.config.settings import Settings, TrackerSettings
from vidtrack.config.video import DetectorSettings
from vidtrack.papers import style
from vidtrack.run.trackers import build_blob_tracker
from vidtrack.run.video import build_detector, video_steps
from vidtrack.scan import Scan
from vidtrack.simulate import Clip
from vidtrack.tracks import Status, Tracks
from vidtrack.video.blobs.blobs import find_blobs
from vidtrack.video.frame import Frame
from vidtrack.video.planes import to_frame

if TYPE_CHECKING:
    from matplotlib.axes import Axes

ON_TARGET = 15.0
"""px; largest distance of a track from the centre of its target."""

APART = 4.0
"""px; targets with a larger gap between their boxes are surely two blobs."""


@dataclass(frozen=True, eq=False)
class Watched:
    """A clip and its detections: a scan for each frame.

    whole   (K, N) whether a target is wholly in the picture
    centre  (K, N, 2) of all targets, NaN outside the picture; box (K, N, 4)
    """

    clip: Clip
    scans: list[Scan]
    whole: np.ndarray
    centre: Floats
    box: Floats


def watch(clip: Clip, detector: DetectorSettings | None = None) -> Watched:
    """Render a clip and detect blobs without predictions of a tracker, so that all trackers get the same blobs.

    As in the paper, the errors of different frames count as independent.
    """
    settings = Settings(detector=detector or DetectorSettings())
    model = build_detector(settings)
    found = [(frame.time_s, find_blobs(model.apply(frame, np.empty((0, 4))), settings.blobs)) for frame in frames(clip)]
    scans = [replace(blobs.scan(time_s), lasting=None) for time_s, blobs in found]
    truth = clip.truth
    shape = (len(clip), len(clip.scene.targets))
    centre, box = np.full((*shape, 2), np.nan), np.full((*shape, 4), np.nan)
    centre[truth.frame, truth.id - 1] = truth.centre
    box[truth.frame, truth.id - 1] = truth.box
    inside = (box[..., :2] > 0).all(axis=-1) & (box[..., :2] + box[..., 2:] < clip.size).all(axis=-1)
    return Watched(clip, scans, inside, centre, box)


def frames(clip: Clip) -> Iterator[Frame]:
    """The clip's frames, without compression."""
    for k, image in enumerate(clip):
        yield to_frame(k, float(clip.times[k]), av.VideoFrame.from_ndarray(image, format="bgr24"))


def by_default(clip: Clip) -> list[Tracks]:
    """Tracks of each frame by the whole pipeline with default settings, with predictions for the detector."""
    settings = Settings()
    tracker = build_blob_tracker(settings.tracker, clip.size)
    return [step.tracks for step in video_steps(frames(clip), build_detector(settings), tracker, settings)]


def follow(watched: Watched, settings: TrackerSettings, scans: list[Scan] | None = None) -> list[Tracks]:
    """Tracks of each frame; scans: replace those of the clip."""
    tracker = build_blob_tracker(settings, watched.clip.size)
    return [tracker.step(scan) for scan in (watched.scans if scans is None else scans)]


def unshared(watched: Watched) -> list[Scan]:
    """The scans without the blobs of touching targets, as from a detector that rejects merged blobs."""
    low, high = watched.box[..., :2], watched.box[..., :2] + watched.box[..., 2:]
    gap = np.maximum(low[:, :, None] - high[:, None], low[:, None] - high[:, :, None]).max(axis=-1)
    gap[:, range(gap.shape[1]), range(gap.shape[1])] = np.inf
    touched = gap.min(axis=2) < APART
    return [_outside(scan, low[k, touched[k]], high[k, touched[k]]) for k, scan in enumerate(watched.scans)]


def _outside(scan: Scan, low: Floats, high: Floats) -> Scan:
    """The scan without blobs that intersect the boxes from low (B, 2) to high (B, 2)."""
    assert scan.box is not None
    start = scan.z + scan.box[:, :2]
    overlap = np.minimum(start[:, None] + scan.box[:, None, 2:], high) - np.maximum(start[:, None], low)
    keep = overlap.min(axis=2).max(axis=1, initial=-np.inf) <= 0
    return Scan(scan.t, scan.z[keep], scan.R[keep], box=scan.box[keep])


def believed(tracks: Tracks) -> tuple[Ints, Floats]:
    """Ids (T,) and positions (T, 2) of the confirmed tracks."""
    known = tracks.status != Status.TENTATIVE
    return tracks.id[known], tracks.xy[known]


def ids_on_targets(watched: Watched, steps: list[Tracks]) -> Ints:
    """(K, N) id of the track on each target, by optimal assignment of distances below ON_TARGET; -1 for none."""
    ids = np.full(watched.whole.shape, -1)
    for k, tracks in enumerate(steps):
        track_id, xy = believed(tracks)
        cost = np.linalg.norm(watched.centre[k][:, None] - xy[None], axis=-1)
        cost = np.where(cost < ON_TARGET, cost, 1e6)  # NaN, a target that is not there, compares false
        target, track = linear_sum_assignment(cost)
        on = cost[target, track] < ON_TARGET
        ids[k, target[on]] = track_id[track[on]]
    return ids


def draw(ax: Axes, watched: Watched, steps: list[Tracks], frame: int, *, first: int = 0) -> None:
    """The picture at `frame`, with the path of each confirmed track from frame `first` on, and its id."""
    picture = watched.clip.frame(frame)[..., ::-1]
    width, height = watched.clip.size
    ax.imshow(picture, extent=(0, width, height, 0), alpha=0.55)
    paths: dict[int, list[Floats]] = {}
    for tracks in steps[first : frame + 1]:
        for track_id, xy in zip(*believed(tracks), strict=True):
            paths.setdefault(int(track_id), []).append(xy)
    for i, (track_id, path) in enumerate(paths.items()):
        colour = style.CYCLE[i % len(style.CYCLE)]
        x, y = np.array(path).T
        ax.plot(x, y, color=colour, lw=2)
        ax.plot(x[-1], y[-1], "o", color=colour, ms=4)
        box = {"boxstyle": "round,pad=0.15", "fc": colour, "ec": "none"}
        ax.text(
            x[-1], max(y[-1] - 6, 14), str(track_id),
            color="white", fontsize=8, weight="bold", ha="center", va="bottom", bbox=box, clip_on=True,
        )  # fmt: skip
    ax.set(xlim=(0, width), ylim=(height, 0), xticks=[], yticks=[])
    ax.spines[["left", "bottom"]].set_visible(False)
