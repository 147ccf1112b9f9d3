"""Reads settings from defaults, then a TOML file, then `--set a.b=value`.

The error for a wrong key or value contains the nearest name or the allowed range.
"""

from __future__ import annotations

import difflib
import tomllib
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any, get_args

from pydantic import BaseModel, ValidationError
from pydantic.fields import FieldInfo

from vidtrack.config.group import read_toml
from vidtrack.config.inputs import Input, is_own, needs, needs_one_of, reads
from vidtrack.config.settings import Settings
from vidtrack.errors import ConfigError


def load(
    path: str | Path | None = None,
    assignments: Iterable[str | tuple[str, Any]] = (),
    base: Mapping[str, Any] | None = None,
    kind: Input | None = None,
) -> Settings:
    """Settings from defaults, a TOML file and assignments ("a.b=value" or (name, value)); later ones take precedence.

    base  nested settings between the defaults and the file
    kind  of the input: settings without effect on it are refused; None: unknown, nothing is refused

    A file may contain groups for other kinds of input, and settings at their defaults. Whether a setting has an effect
    is judged by all settings together.
    Raises ConfigError for an unreadable file, an unknown key, a bad value, or a setting without effect.
    """
    filed = {} if path is None else read_toml(Path(path), "settings")
    assigned = [_split(one) if isinstance(one, str) else one for one in assignments]
    tree = merged(base or {}, filed)
    for name, value in assigned:
        _assign(tree, name.split("."), value)
    settings = parse(tree)
    if kind is not None:
        usual = Settings()
        own = (name for name in _leaves(filed) if is_own(kind, name))
        unusual = [name for name in own if value_of(settings, name) != value_of(usual, name)]
        _refuse_idle(kind, settings, dict.fromkeys([*unusual, *(name for name, _ in assigned)]))
    return settings


def parse(tree: Mapping[str, Any]) -> Settings:
    """Settings from nested mappings. Raises ConfigError for an unknown key or a bad value."""
    try:
        return Settings.model_validate(tree)
    except ValidationError as error:
        raise ConfigError("\n".join(_complaint(detail) for detail in error.errors())) from None


def merged(base: Mapping[str, Any], tree: Mapping[str, Any]) -> dict[str, Any]:
    """Nested settings: `base` overridden by `tree`. No group of the result is one of theirs."""

    def group(name: str) -> Any:
        newest = tree.get(name, base.get(name))
        if not isinstance(newest, dict):
            return newest
        older = base.get(name)
        return merged(older if isinstance(older, dict) else {}, newest)

    return {name: group(name) for name in {**base, **tree}}


def value_of(settings: BaseModel, name: str) -> Any:
    """The value of a setting by its dotted name."""
    value: Any = settings
    for part in name.split("."):
        value = getattr(value, part)
    return value


def _refuse_idle(kind: Input, settings: Settings, asked: Iterable[str]) -> None:
    """Raise ConfigError for given settings that have no effect on this kind of input."""
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
        elif (choices := needs_one_of(name)) and all(value_of(settings, other) != value for other, value in choices):
            wanted = " or ".join(f"{other}={_as_written(value)}" for other, value in choices)
            complaints.append(f"setting {name} has no effect here; it needs {wanted}")
    if complaints:
        raise ConfigError("\n".join(complaints))


def _nearest(name: str, known: Iterable[str]) -> str:
    """The name to suggest: the same name in another group, or a similar name."""
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
    name, text = name.strip(), text.strip()
    return name, text if text in _choices(name) else _value(text)


def _choices(name: str) -> tuple[Any, ...]:
    """The names among which a setting is chosen; none for another setting, a group, and an unknown name."""
    return next((get_args(info.annotation) for known, info in _fields() if known == name), ())


def _value(text: str) -> Any:
    """A TOML value, else the text itself: `--set tracker.method=nn` needs no quotes."""
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
    """One line per error: the setting, its value, and the allowed values."""
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


def names() -> Iterator[str]:
    """Dotted names of all settings and groups."""
    return (name for name, _ in _fields())


def _fields(group: type[BaseModel] = Settings, prefix: str = "") -> Iterator[tuple[str, FieldInfo]]:
    """All settings and groups, each with its dotted name."""
    for name, info in group.model_fields.items():
        yield prefix + name, info
        kind = info.annotation
        if isinstance(kind, type) and issubclass(kind, BaseModel):
            yield from _fields(kind, f"{prefix}{name}.")
