"""Settings: frozen, typed, in seconds, pixels and probabilities; `None` means "take it from the data".

Read from defaults, then a TOML file, then `--set a.b=value`; a wrong key or value fails at once
with the nearest name or the allowed range. `vidtrack config --explain` prints this file's descriptions.
"""

from __future__ import annotations

import difflib
import tomllib
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from pydantic import BaseModel, Field, ValidationError, ValidationInfo, field_validator

from vidtrack.errors import ConfigError
from vidtrack.settings.group import Group
from vidtrack.settings.inputs import Input as Input
from vidtrack.settings.inputs import is_own, needs, reads
from vidtrack.settings.live import LiveSettings as LiveSettings
from vidtrack.settings.names import Distance, Life, Method
from vidtrack.settings.radar import RadarSettings as RadarSettings
from vidtrack.settings.video import BlobSettings as BlobSettings
from vidtrack.settings.video import DetectorSettings as DetectorSettings
from vidtrack.settings.video import DisturbanceSettings as DisturbanceSettings
from vidtrack.settings.video import PaperSettings as PaperSettings
from vidtrack.toml_file import read_toml


class SourceSettings(Group):
    start_s: float = Field(0.0, ge=0)
    """s; frames before this media time are skipped"""
    end_s: float | None = Field(None, ge=0)
    """s; frames after this media time are skipped; None: to the end"""
    fps: float | None = Field(None, gt=0, le=1000)
    """frames/s where the input carries no times or wrong ones; None: the video's own, seqinfo.ini's, else 25"""
    scale: float | None = Field(None, gt=0, le=1)
    """processed over source size, rounded to 1, 1/2, 1/3, ...; None: the largest of these with at most 580 rows"""
    mask: Path | None = None
    """picture whose white part is kept; None: everything"""

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
    """object sizes/s^2; tracker.accel for them, and in proportion tracker.cross; None: as for jitter"""
    confirm_hits: int = Field(4, ge=1, le=63)
    """M: hits within the window that confirm a track, the first one counted; confirm_s, confirm_travel do not apply"""
    confirm_window: int = Field(6, ge=1, le=63)
    """N: scans of the window"""
    detection_probability: float | None = Field(0.8, ge=0, le=1)
    """probability that a frame shows an object, tracker.detection_probability for them; None: from the tracks so far"""
    box_s: float = Field(0.05, gt=0)
    """s; time constant with which a track's box follows its detections' boxes"""


class TrackerSettings(Group):
    """Object size is the longer side of a vehicle's box."""

    method: Method = "gnn"
    """association: one measurement (nn, gnn, sn), weights (generalized-nn, psn, pda, jpda), deferred (split, mht)"""
    n_scan: int = Field(3, ge=1, le=20)
    """scans after which split and mht decide"""
    distance: Distance = "mahalanobis"
    """confidence region with the full covariance, with the variances per axis only (eq. 8), or plain distance"""
    gate_probability: float = Field(0.999, ge=0, le=1)
    """share of a vehicle's own measurements that fall inside its gate"""
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
    """what confirms a track: M hits within N scans, or its log-likelihood ratio (llr), which also ends it"""
    confirm_hits: int = Field(3, ge=1, le=63)
    """M: hits within the window that confirm a track, the first one counted"""
    confirm_window: int = Field(4, ge=1, le=63)
    """N: scans of the window"""
    false_track: float = Field(1e-3, ge=1e-8, lt=0.5)
    """llr: probability that a track of false measurements is confirmed"""
    missed_track: float = Field(1e-4, ge=1e-8, lt=0.5)
    """llr: probability that the track of a real object is deleted"""
    detection_probability: float | None = Field(0.9, ge=0, le=1)
    """probability that a frame shows a vehicle; None: from the tracks so far. Radar has its own"""
    clutter_density: float | None = Field(1e-5, ge=0)
    """false measurements per frame and px^2; None: from what the tracks leave. Radar has its own"""
    redundant: float | None = Field(None, gt=0, lt=1)
    """probability with which two measurements of one target in a scan are combined before association; None: never"""
    confirm_s: float = Field(0.4, ge=0)
    """s; no track of a video is confirmed before this age; most ghosts of the first frame's vehicles are gone then"""
    confirm_travel: float = Field(0.5, ge=0)
    """object sizes, at least 1/30 of the picture's; nor before it has moved this far from its start"""
    coast_s: float = Field(0.6, ge=0)
    """s; a track is given up this long after its last evidence"""
    hidden_s: float = Field(2.0, ge=0)
    """s; the same for a vehicle inside a blob that it shares, where nothing could be seen of it"""
    idle_s: float | None = Field(4.0, gt=0)
    """s; m-of-n: a track of a video that stands still for so long and has never travelled ends; None: it stays"""
    idle_travel: float = Field(1.2, ge=0)
    """object sizes; what has been this far from its start has travelled, and may stand as long as it likes"""
    restless: bool = True
    """where tracks began in vain lately, as under a tree, others must travel three times as far to be confirmed"""
    blob_overlap: float = Field(0.3, gt=0, le=1)
    """intersection over union with a blob outside the gate that keeps a track on it; 1: never"""
    merged_blobs: bool = True
    """vehicles that share one blob stay several tracks"""
    group_cover: float = Field(0.5, gt=0, le=1)
    """share of a vehicle's predicted box that a blob must cover to carry it"""
    box_s: float = Field(0.3, gt=0)
    """s; time constant with which a track's box follows the blobs' boxes"""

    @field_validator("confirm_window")
    @classmethod
    def _holds_the_hits(cls, window: int, given: ValidationInfo) -> int:
        hits = given.data.get("confirm_hits", 1)
        if window < hits:
            raise ValueError(f"must not be less than tracker.confirm_hits = {hits}")
        return window


class OutputSettings(Group):
    smooth: bool = False
    """tracks are smoothed: each row uses the measurements after it too; not in live runs"""
    smooth_lag_s: float | None = Field(None, gt=0)
    """s; how far ahead smoothing looks, rows appearing one to two times as late; None: to the end, when all appear"""
    link: bool | None = None
    """broken tracks are joined and gaps filled, at the end; not in live and radar runs; None: of stored detections"""
    link_s: float = Field(3.0, gt=0)
    """s; longest gap between the last measurement of a track and the first of the one that goes on with it"""
    lines: tuple[str, ...] = ()
    """counting lines, each NAME:x1,y1,x2,y2 in source pixels"""
    site: Path | None = None
    """site.toml with a calibration: positions in metres and speeds are written; None: pixels only"""
    trail_s: float = Field(2.0, ge=0, le=60)
    """s; how far back the trail behind a vehicle reaches in the annotated video and in rerun"""
    video_crf: int = Field(23, ge=0, le=51)
    """constant rate factor of the annotated H.264 video; smaller is sharper and larger"""
    jpeg_quality: int = Field(75, ge=1, le=100)
    """quality of the pictures in a rerun recording; larger is sharper and larger"""
    rerun_picture_s: float = Field(0.0, ge=0)
    """s; least time between the pictures of a rerun recording, for long runs; 0: every frame"""


class Settings(Group):
    """Everything that a run can be told."""

    source: SourceSettings = SourceSettings()
    detector: DetectorSettings = DetectorSettings()
    blobs: BlobSettings = BlobSettings()
    detections: DetectionSettings = DetectionSettings()
    tracker: TrackerSettings = TrackerSettings()
    radar: RadarSettings = RadarSettings()
    output: OutputSettings = OutputSettings()
    live: LiveSettings = LiveSettings()


def load(
    path: str | Path | None = None,
    assignments: Iterable[str | tuple[str, Any]] = (),
    base: Mapping[str, Any] | None = None,
    kind: Input | None = None,
) -> Settings:
    """Settings from defaults, a TOML file and assignments ("a.b=value" or a name with its value), later ones winning.

    base  nested settings between the defaults and the file
    kind  of the input: settings that have no effect on it are refused; None: not known, and nothing is refused

    A file may hold groups for other kinds of input, and settings at their defaults.
    Raises ConfigError for an unreadable file, an unknown key (naming the nearest), a bad value, or one without effect.
    """
    filed = {} if path is None else read_toml(Path(path), "settings")
    assigned = [_split(one) if isinstance(one, str) else one for one in assignments]
    tree = merged(base or {}, filed)
    if kind is not None and filed:
        alone, usual = parse(tree), Settings()
        own = (name for name in _leaves(filed) if is_own(kind, name))
        _refuse_idle(kind, alone, [name for name in own if value_of(alone, name) != value_of(usual, name)])
    for name, value in assigned:
        _assign(tree, name.split("."), value)
    settings = parse(tree)
    if kind is not None:
        _refuse_idle(kind, settings, [name for name, _ in assigned])
    return settings


def parse(tree: Mapping[str, Any]) -> Settings:
    """Settings from nested mappings. Raises ConfigError for an unknown key or a bad value."""
    try:
        return Settings.model_validate(tree)
    except ValidationError as error:
        raise ConfigError("\n".join(_complaint(detail) for detail in error.errors())) from None


def merged(base: Mapping[str, Any], tree: Mapping[str, Any]) -> dict[str, Any]:
    """Nested settings: `tree` where it says something, `base` elsewhere."""
    both = dict(base) | dict(tree)
    groups = (name for name in tree if isinstance(base.get(name), dict) and isinstance(tree[name], dict))
    return both | {name: merged(base[name], tree[name]) for name in groups}


def value_of(settings: BaseModel, name: str) -> Any:
    """The setting with that dotted name."""
    value: Any = settings
    for part in name.split("."):
        value = getattr(value, part)
    return value


def _refuse_idle(kind: Input, settings: Settings, asked: Iterable[str]) -> None:
    """Raise ConfigError for settings that were asked for and have no effect on that kind of input."""
    complaints = []
    for name in asked:
        missing = [(other, values) for other, values in needs(kind, name) if value_of(settings, other) not in values]
        if not reads(kind, name):
            near = _nearest(name, (other for other in _leaves(Settings().model_dump()) if reads(kind, other)))
            complaints.append(f"setting {name} has no effect on {kind}{near}")
        elif missing:
            other, values = missing[0]
            wanted = " or ".join(_as_written(value) for value in values)
            now = _as_written(value_of(settings, other))
            complaints.append(f"setting {name} has no effect with {other}={now}; it needs {other}={wanted}")
    if complaints:
        raise ConfigError("\n".join(complaints))


def _nearest(name: str, known: Iterable[str]) -> str:
    """What to suggest instead: the setting of the same name in another group, or of a similar one."""
    of_last: dict[str, str] = {}
    for other in known:
        of_last.setdefault(other.rpartition(".")[2], other)
    near = difflib.get_close_matches(name.rpartition(".")[2], of_last, n=1, cutoff=0.7)
    return f"; the nearest that has is {of_last[near[0]]}" if near else "; see vidtrack config --explain"


def _as_written(value: Any) -> str:
    return str(value).lower() if isinstance(value, bool) else str(value)


def _leaves(tree: Mapping[str, Any], prefix: str = "") -> Iterable[str]:
    """Dotted names of the values in nested settings."""
    for name, value in tree.items():
        if isinstance(value, Mapping):
            yield from _leaves(value, f"{prefix}{name}.")
        else:
            yield prefix + name


def _split(assignment: str) -> tuple[str, Any]:
    name, equals, text = assignment.partition("=")
    if not equals or not name.strip():
        raise ConfigError(f"--set {assignment!r}: write it as group.name=value")
    return name.strip(), _value(text.strip())


def _value(text: str) -> Any:
    """A TOML value, or the bare text: `--set tracker.method=nn` needs no quotes."""
    if text.lower() in ("none", "null"):
        return None
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError:
        return text


def _assign(tree: dict[str, Any], keys: list[str], value: Any) -> None:
    for key in keys[:-1]:
        below = tree.setdefault(key, {})
        if not isinstance(below, dict):
            raise ConfigError(f"setting {'.'.join(keys)}: {key} is a value, not a group")
        tree = below
    tree[keys[-1]] = value


def _complaint(detail: Any) -> str:
    """One line for one mistake: the setting, what was given, what is allowed."""
    path = [str(part) for part in detail["loc"]]
    name = ".".join(path)
    if detail["type"] == "extra_forbidden":
        near = difflib.get_close_matches(name, list(names()), n=1, cutoff=0.4)
        hint = f"; did you mean {near[0]}?" if near else "; see vidtrack config --explain"
        return f"unknown setting {name}{hint}"
    if detail["type"] == "model_type":
        return f"setting {name} = {detail['input']!r}: this is a group; give one of its settings, {name}.NAME"
    message = detail["msg"].removeprefix("Value error, ")
    return f"setting {name} = {detail['input']!r}: {message[0].lower()}{message[1:]}"


def names(group: type[BaseModel] = Settings, prefix: str = "") -> Iterable[str]:
    """Dotted names of all settings and groups."""
    for name, info in group.model_fields.items():
        yield prefix + name
        kind = info.annotation
        if isinstance(kind, type) and issubclass(kind, BaseModel):
            yield from names(kind, f"{prefix}{name}.")
