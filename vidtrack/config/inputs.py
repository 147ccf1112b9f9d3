"""The settings that have an effect on each kind of input."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from enum import StrEnum
from typing import Any, get_args

from vidtrack.config.names import LaterMethod, Method


class Input(StrEnum):
    """Kinds of input; the values are their names in messages."""

    VIDEO = "a video"
    RECORDING = "a recording of a live run"
    CAMERA = "a camera"
    DETECTIONS = "stored detections"
    RADAR = "radar plots"


_OWN = {
    Input.VIDEO: ("detector", "blobs"),
    Input.RECORDING: ("detector", "blobs"),
    Input.CAMERA: ("detector", "blobs", "live", "events"),
    Input.DETECTIONS: ("detections",),
    Input.RADAR: ("radar",),
}
"""Groups for one kind of input only; `source`, `tracker` and `output` are common."""

_OF_PICTURES = (
    *("tracker.box_s", "tracker.confirm_s", "tracker.confirm_travel", "tracker.detection_probability"),
    *("tracker.idle_s", "tracker.idle_travel", "tracker.restless", "tracker.look", "tracker.relieve"),
    *("tracker.blob_overlap", "tracker.merged_blobs", "tracker.group_cover", "tracker.hidden_s", "tracker.parts"),
    *("source.max_fps", "source.scale", "source.mask", "source.decoder", "output.video_crf", "output.jpeg_quality"),
)
_OF_THE_PREVIEW = ("detector.disturbance.preview_s", "detector.disturbance.patches")
_OF_OTHER_INPUT = ("detections", "radar", "live", "events", "tracker.redundant")
_UNREAD = {
    Input.VIDEO: _OF_OTHER_INPUT,
    Input.RECORDING: (
        *_OF_OTHER_INPUT,
        *(f"source.{name}" for name in ("start_s", "end_s", "fps", "max_fps", "decoder")),
        *_OF_THE_PREVIEW,
    ),
    Input.CAMERA: (
        *("detections", "radar", "tracker.redundant"),
        *_OF_THE_PREVIEW,
        *("output.smooth", "output.smooth_lag_s"),
    ),
    Input.DETECTIONS: (
        *("detector", "blobs", "radar", "live", "events"),
        *_OF_PICTURES,
        *("tracker.confirm_hits", "tracker.confirm_window"),
    ),
    Input.RADAR: (
        *("detector", "blobs", "detections", "live", "events", "source"),
        *_OF_PICTURES,
        *("tracker.accel", "tracker.cross", "tracker.hold_s", "tracker.speed"),
        *("tracker.life", "tracker.coast_s", "tracker.clutter_density", "tracker.euclidean_radius_px"),
        *(
            "output.level",
            "output.every_s",
            "output.lines",
            "output.site",
            "output.link",
            "output.link_s",
            "output.trail_s",
            "output.rerun_picture_s",
        ),
    ),
}
"""Groups and settings without effect on an input."""


class _Such:
    """Equal to every value of which something holds, which messages call by a name."""

    __hash__ = None  # type: ignore[assignment]

    def __init__(self, holds: Callable[[Any], bool], name: str) -> None:
        self._holds, self._name = holds, name

    def __eq__(self, other: object) -> bool:
        return self._holds(other)

    def __str__(self) -> str:
        return self._name


GIVEN = _Such(lambda value: value is not None, "NUMBER")
_ABOVE_ZERO = _Such(lambda value: value > 0, "a number above zero")
_LATER = get_args(LaterMethod)
_AT_ONCE = tuple(method for method in get_args(Method) if method not in _LATER)

_NEEDS: Mapping[str, tuple[str, tuple[Any, ...]]] = {
    "detector.disturbance": ("detector.kind", ("disturbance",)),
    "detector.disturbance.chroma_threshold": ("detector.disturbance.chroma", (True,)),
    "detector.disturbance.amid": ("detector.disturbance.shadow", (True,)),
    "detector.disturbance.dark": ("detector.disturbance.shadow", (True,)),
    "detector.disturbance.guard_px": ("detector.disturbance.selective", (True,)),
    "detector.disturbance.ghost_s": ("detector.disturbance.ghosts", (True,)),
    "detector.disturbance.still_s": ("detector.disturbance.registration", (True,)),
    "detector.disturbance.patches": ("detector.disturbance.preview_s", (_ABOVE_ZERO,)),
    "detector.paper": ("detector.kind", ("paper",)),
    "tracker.n_scan": ("tracker.method", _LATER),
    "tracker.merged_blobs": ("tracker.method", _AT_ONCE),
    "tracker.euclidean_radius_px": ("tracker.distance", ("euclidean",)),
    "tracker.confirm_hits": ("tracker.life", ("m-of-n",)),
    "tracker.confirm_window": ("tracker.life", ("m-of-n",)),
    "tracker.idle_s": ("tracker.life", ("m-of-n",)),
    "tracker.false_track": ("tracker.life", ("llr",)),
    "tracker.missed_track": ("tracker.life", ("llr",)),
    "tracker.blob_overlap": ("tracker.merged_blobs", (True,)),
    "tracker.group_cover": ("tracker.merged_blobs", (True,)),
    "tracker.parts": ("tracker.merged_blobs", (True,)),
    "tracker.hidden_s": ("tracker.merged_blobs", (True,)),
    "detections.confirm_hits": ("tracker.life", ("m-of-n",)),
    "detections.confirm_window": ("tracker.life", ("m-of-n",)),
    "radar.euclidean_radius_m": ("tracker.distance", ("euclidean",)),
    "radar.particles": ("radar.estimator", ("particle",)),
    "radar.resampling": ("radar.estimator", ("particle",)),
    "radar.glint": ("radar.estimator", ("particle",)),
    "radar.clutter_map": ("radar.clutter_density", (None,)),
    "radar.quiet_accel": ("radar.estimator", ("imm",)),
    "radar.quiet_s": ("radar.estimator", ("imm",)),
    "radar.manoeuvre_s": ("radar.estimator", ("imm",)),
    "radar.agile": ("radar.estimator", ("imm",)),
    "radar.pfa_max": ("radar.snr_db", (GIVEN,)),
    "radar.group_merge_m": ("radar.group_link_m", (GIVEN,)),
    "live.keep_pictures_s": ("events.pictures", (True,)),
    "live.keep_pictures_bytes": ("events.pictures", (True,)),
    **dict.fromkeys(
        ("output.every_s", "output.smooth", "output.smooth_lag_s", "output.link", "output.link_s"),
        ("output.level", ("tracks", "all")),
    ),
}
"""Groups and settings that have an effect only if another setting has one of these values."""

_CELL = ("cell_range_m", "cell_azimuth_deg", "cell_elevation_deg")

_EITHER = dict.fromkeys((f"radar.{name}" for name in _CELL), (("radar.unresolved", True), ("radar.snr_db", GIVEN)))
"""Settings that have an effect if one of these others has its value."""

_REPLACED: Mapping[str, tuple[str, ...]] = {
    "radar.snr_db": ("radar.detection_probability", "radar.clutter_density", "radar.clutter_map"),
    "radar.group_link_m": tuple(f"radar.{name}" for name in ("unresolved", *_CELL)),
}
"""Settings without effect if this one is given."""
_WHERE_STORED = {"output.link_s": "output.link", "output.smooth_lag_s": "output.smooth"}
"""Settings without effect unless this one is set; stored detections have it by default"""
_OTHER_LIFE = {Input.RADAR: "radar.life"}


def reads(kind: Input, name: str) -> bool:
    """Whether the setting has an effect on this kind of input."""
    return not any(_is_within(name, unread) for unread in _UNREAD[kind])


def needs(kind: Input, name: str) -> Iterator[tuple[str, tuple[Any, ...]]]:
    """Settings on which the effect of this one depends, each with its required values."""
    if name in _WHERE_STORED:
        yield _WHERE_STORED[name], (True, None) if kind is Input.DETECTIONS else (True,)
    if name == "output.smooth_lag_s" and kind is not Input.RADAR:  # a link waits for the end
        yield "output.link", (False,) if kind is Input.DETECTIONS else (False, None)
    for other, idle in _REPLACED.items():
        if name in idle:
            yield other, (None,)
    for part, (other, values) in _NEEDS.items():
        if _is_within(name, part):
            yield _OTHER_LIFE.get(kind, other) if other == "tracker.life" else other, values
            yield from needs(kind, other)


def needs_one_of(name: str) -> tuple[tuple[str, Any], ...]:
    """Settings with values of which one is enough for this setting to have an effect; none: it depends on no such."""
    return _EITHER.get(name, ())


def is_own(kind: Input, name: str) -> bool:
    """Whether the setting is in a group for this kind of input only."""
    return any(_is_within(name, group) for group in _OWN[kind])


def _is_within(name: str, group: str) -> bool:
    return name == group or name.startswith(f"{group}.")
