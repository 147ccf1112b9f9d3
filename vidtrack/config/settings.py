"""Settings: frozen, typed, in seconds, pixels and probabilities; None: estimated from the data.

`load.py` reads them. `vidtrack config --explain` prints their docstrings.
"""

from __future__ import annotations

import math
from pathlib import Path

from pydantic import Field, ValidationInfo, field_validator

from vidtrack.config.events import EventSettings
from vidtrack.config.group import Group
from vidtrack.config.live import LiveSettings
from vidtrack.config.names import Decoder, Distance, Level, Life, Method
from vidtrack.config.radar import RadarSettings
from vidtrack.config.video import BlobSettings, DetectorSettings

_ROUNDING = 0.02  # 30.02 frames/s of a phone are 30: a greater max_fps is not asked of the user


class SourceSettings(Group):
    start_s: float = Field(0.0, ge=0)
    """s; frames before this media time are skipped"""
    end_s: float | None = Field(None, ge=0)
    """s; frames after this media time are skipped; None: to the end"""
    fps: float | None = Field(None, gt=0, le=1000)
    """frames/s if the input has no times or wrong ones; None: from the video or seqinfo.ini, else 25"""
    max_fps: float | None = Field(None, ge=1, le=1000)
    """frames/s; every 2nd, 3rd, ... picture of a file is looked at, of a camera so many; None: all"""
    scale: float | None = Field(None, gt=0, le=1)
    """processed over source size, rounded to 1, 1/2, 1/3, ...; None: the largest of these with at most 500 rows"""
    mask: Path | None = None
    """picture whose white part is tracked; None: everything"""
    decoder: Decoder = "software"
    """hardware that decodes video (Linux: vaapi, nvdec; macOS: videotoolbox); auto: the first found, else software"""

    def looked_at_fps(self, fps: float) -> float:
        """Frames/s that are looked at of a source with `fps`."""
        return fps if self.max_fps is None else fps / max(1, math.ceil(fps / self.max_fps - _ROUNDING))

    @field_validator("end_s")
    @classmethod
    def _after_start(cls, end_s: float | None, given: ValidationInfo) -> float | None:
        start_s = given.data.get("start_s", 0.0)
        if end_s is not None and end_s < start_s:
            raise ValueError(f"must not be before source.start_s = {start_s:g}")
        return end_s


class DetectionSettings(Group):
    """Stored detections (MOT det.txt); object size is the longer side of a box."""

    sure_score: float | None = Field(None, ge=0, le=1)
    """share of detections, those of lowest score, that may continue tracks but start none; None: from the file"""
    jitter: float | None = Field(None, gt=0)
    """object sizes; standard deviation of a box's centre; None: from the file (differences along chains of boxes)"""
    accel: float | None = Field(None, gt=0)
    """object sizes/s^2; replaces tracker.accel, and tracker.cross in proportion; None: from the file"""
    confirm_hits: int = Field(4, ge=1, le=63)
    """M: hits within the window that confirm a track, with the first; confirm_s, confirm_travel do not apply"""
    confirm_window: int = Field(6, ge=1, le=63)
    """N: scans of the window"""
    detection_probability: float | None = Field(0.8, ge=0, le=1)
    """probability that a frame shows an object, replaces tracker.detection_probability; None: from earlier tracks"""
    box_s: float = Field(0.05, gt=0)
    """s; time constant with which a track's box follows its detections' boxes"""


class TrackerSettings(Group):
    """Object size is the longer side of a vehicle's box."""

    method: Method = "gnn"
    """association: one (nn, gnn, sn), weights (generalized-nn, psn, pda, jpda, jpda-star), later (split, mht)"""
    n_scan: int = Field(3, ge=1, le=20)
    """scans after which split and mht decide"""
    distance: Distance = "mahalanobis"
    """confidence region with the full covariance, with the variances per axis only (eq. 8), or plain distance"""
    gate_probability: float | None = Field(None, ge=0, le=1)
    """share of a target's own measurements inside its gate; None: .999; radar: where target is likelier than clutter"""
    euclidean_radius_px: float = Field(50.0, gt=0)
    """px; gate of the euclidean distance"""
    accel: float = Field(2.0, gt=0)
    """object sizes/s^2; standard deviation of the acceleration along the heading"""
    cross: float = Field(0.7, gt=0)
    """object sizes/s^2; the same across the heading"""
    hold_s: float = Field(0.5, gt=0)
    """s; correlation time of the acceleration"""
    speed: float = Field(4.0, gt=0)
    """object sizes/s; standard deviation of a new vehicle's unknown velocity"""
    life: Life = "m-of-n"
    """confirmation of a track: M hits within N scans, or its log-likelihood ratio (llr), which also ends it"""
    confirm_hits: int = Field(3, ge=1, le=63)
    """M: hits within the window that confirm a track, with the first"""
    confirm_window: int = Field(4, ge=1, le=63)
    """N: scans of the window"""
    false_track: float = Field(1e-3, ge=1e-8, lt=0.5)
    """llr: probability that a track of false measurements is confirmed"""
    missed_track: float = Field(2e-4, ge=1e-8, lt=0.5)
    """llr: probability that the track of a real object is deleted"""
    detection_probability: float | None = Field(0.9, ge=0, le=1)
    """probability that a frame shows a vehicle; None: from earlier tracks. Radar has its own"""
    clutter_density: float | None = Field(1e-5, ge=0)
    """false measurements per frame and px^2; None: from unassociated measurements. Radar has its own"""
    redundant: float | None = Field(None, gt=0, lt=1)
    """probability with which two measurements of one target in a scan are combined before association; None: never"""
    confirm_s: float = Field(0.4, ge=0)
    """s; least age of a confirmed track of a video; most ghosts of the first frame's vehicles end before"""
    confirm_travel: float = Field(0.5, ge=0)
    """object sizes, at least 1/30 of the picture's; least distance of a confirmed track from its start"""
    coast_s: float = Field(0.6, ge=0)
    """s; a track ends this long after its last measurement"""
    hidden_s: float = Field(2.0, ge=0)
    """s; the same for a vehicle hidden in a shared blob"""
    idle_s: float | None = Field(4.0, gt=0)
    """s; m-of-n: a track of a video that has stood still for this time and never travelled ends; None: it stays"""
    idle_travel: float = Field(1.2, ge=0)
    """object sizes; who was this far from the start, or half as far if in over the border, may then stand"""
    restless: bool = True
    """where tracks recently failed, new ones must travel three times as far; none as small as snow is confirmed"""
    blob_overlap: float = Field(0.3, gt=0, le=1)
    """intersection over union with a blob outside the gate that keeps a track on it; 1: never"""
    merged_blobs: bool = True
    """vehicles that share one blob stay separate tracks"""
    group_cover: float = Field(0.5, gt=0, le=1)
    """share of a vehicle's predicted box that a shared blob must cover"""
    parts: bool = True
    """a track that keeps its place in the box of a larger one, which drives, ends: it is a part of that vehicle"""
    box_s: float = Field(0.3, gt=0)
    """s; time constant with which a track's box follows the blobs' boxes"""
    look: bool = True
    """mean luminance and colour of blobs count in the association"""
    relieve: bool = True
    """a track that drives out over the border, and comes in again before it was out, ends: that is another vehicle"""

    @field_validator("confirm_window")
    @classmethod
    def _holds_the_hits(cls, window: int, given: ValidationInfo) -> int:
        hits = given.data.get("confirm_hits", 1)
        if window < hits:
            raise ValueError(f"must not be less than tracker.confirm_hits = {hits}")
        return window


class OutputSettings(Group):
    level: Level = "all"
    """how much is written: counts, also tracks (tracks.parquet alone), or all (also CSV, MOT and picture)"""
    every_s: float = Field(0.0, ge=0)
    """s; least time between two frames in the files of tracks, so that they are smaller; 0: every frame"""
    smooth: bool | None = None
    """tracks are smoothed: each row uses the measurements after it too; not in live runs; None: stored detections"""
    smooth_lag_s: float | None = Field(None, gt=0)
    """s; smoothing lag, without links: rows appear after one to two times this; None: over all, written at the end"""
    link: bool | None = None
    """broken tracks are joined and gaps filled, at the end; not in live and radar runs; None: for stored detections"""
    link_s: float = Field(3.0, gt=0)
    """s; longest gap between the last measurement of a track and the first of its continuation"""
    lines: tuple[str, ...] = ()
    """counting lines, each NAME:x1,y1,x2,y2 in source pixels"""
    site: Path | None = None
    """site.toml with a calibration, for positions in metres and speeds; None: pixels only"""
    trail_s: float = Field(2.0, ge=0, le=60)
    """s; length of a vehicle's trail in the annotated video and in rerun"""
    video_crf: int = Field(23, ge=0, le=51)
    """constant rate factor of the annotated H.264 video; smaller is sharper and larger"""
    jpeg_quality: int = Field(75, ge=1, le=100)
    """quality of the pictures in a rerun recording; larger is sharper and larger"""
    rerun_picture_s: float = Field(0.0, ge=0)
    """s; least time between the pictures of a rerun recording, for long runs; 0: every frame"""


class Settings(Group):
    """All settings of a run."""

    source: SourceSettings = SourceSettings()
    detector: DetectorSettings = DetectorSettings()
    blobs: BlobSettings = BlobSettings()
    detections: DetectionSettings = DetectionSettings()
    tracker: TrackerSettings = TrackerSettings()
    radar: RadarSettings = RadarSettings()
    output: OutputSettings = OutputSettings()
    live: LiveSettings = LiveSettings()
    events: EventSettings = EventSettings()
