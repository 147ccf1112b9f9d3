"""Settings: frozen, typed, in seconds, pixels and probabilities; `None` means "take it from the data".

Read from defaults, then a TOML file, then `--set a.b=value`; a wrong key or value fails at once
with the nearest name or the allowed range. `vidtrack config --explain` prints this file's descriptions.
"""

from __future__ import annotations

import difflib
import tomllib
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from vidtrack.errors import ConfigError


class _Group(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", use_attribute_docstrings=True)


class SourceSettings(_Group):
    start_s: float = Field(0.0, ge=0)
    """s; frames before this media time are skipped"""
    end_s: float | None = Field(None, ge=0)
    """s; frames after this media time are skipped; None: to the end"""
    fps: float | None = Field(None, gt=0, le=1000)
    """frames/s for inputs that carry no time (image folders, MOT files); None: seqinfo.ini, else 25"""
    scale: float | None = Field(None, gt=0, le=1)
    """processed size over source size; None: 1 up to 580 rows, then 1 over the smallest integer that gets there"""
    mask: Path | None = None
    """picture whose white part is kept; None: everything"""


class DisturbanceSettings(_Group):
    """Placeholder until the detector defines its settings."""


class PaperSettings(_Group):
    weight: float = Field(0.1, gt=0, le=1)
    """share of the new frame in the average, per frame"""
    threshold: float = Field(20.0, gt=0, le=255)
    """grey levels; a larger difference from the average is a disturbance"""
    two_sided: bool = True
    """both darker and brighter than the average; false: brighter only"""


class DetectorSettings(_Group):
    kind: Literal["disturbance", "paper", "mog2", "knn"] = "disturbance"
    """how the foreground is found"""
    disturbance: DisturbanceSettings = DisturbanceSettings()
    paper: PaperSettings = PaperSettings()


class BlobSettings(_Group):
    """Placeholder until the blob stage defines its settings."""


class TrackerSettings(_Group):
    """Placeholder until the tracker defines its settings."""


class OutputSettings(_Group):
    """Placeholder until the outputs define their settings."""


class Settings(_Group):
    """Everything that a run can be told."""

    source: SourceSettings = SourceSettings()
    detector: DetectorSettings = DetectorSettings()
    blobs: BlobSettings = BlobSettings()
    tracker: TrackerSettings = TrackerSettings()
    output: OutputSettings = OutputSettings()


def load(path: Path | None = None, assignments: Iterable[str] = ()) -> Settings:
    """Settings from defaults, a TOML file and `a.b=value` assignments, the later ones winning.

    Raises ConfigError for an unreadable file, an unknown key (naming the nearest) or a bad value.
    """
    tree: dict[str, Any] = {}
    if path is not None:
        try:
            tree = tomllib.loads(path.read_text(encoding="utf-8"))
        except OSError as error:
            raise ConfigError(f"cannot read settings {path}: {error.strerror or error}") from None
        except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
            raise ConfigError(f"{path} is not valid TOML: {error}") from None
    for assignment in assignments:
        key, equals, text = assignment.partition("=")
        if not equals or not key.strip():
            raise ConfigError(f"--set {assignment!r}: write it as group.name=value")
        _assign(tree, key.strip().split("."), _value(text.strip()))
    return parse(tree)


def parse(tree: Mapping[str, Any]) -> Settings:
    """Settings from nested mappings. Raises ConfigError for an unknown key or a bad value."""
    try:
        return Settings.model_validate(tree)
    except ValidationError as error:
        raise ConfigError("\n".join(_complaint(detail) for detail in error.errors())) from None


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
    return f"setting {name} = {detail['input']!r}: {detail['msg'][0].lower()}{detail['msg'][1:]}"


def names(group: type[BaseModel] = Settings, prefix: str = "") -> Iterable[str]:
    """Dotted names of all settings and groups."""
    for name, info in group.model_fields.items():
        yield prefix + name
        kind = info.annotation
        if isinstance(kind, type) and issubclass(kind, BaseModel):
            yield from names(kind, f"{prefix}{name}.")
