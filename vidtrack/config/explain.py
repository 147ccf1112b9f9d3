"""Writes the settings as a TOML file."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, get_args

from pydantic import BaseModel
from pydantic.fields import FieldInfo

from vidtrack.config.settings import Settings


def as_toml(settings: Settings, *, explain: bool = False) -> str:
    """The settings as a TOML file that `load` reads; with `explain`, each with its meaning, unit and range."""
    return "\n".join(_toml_group(settings, "", explain)) + "\n"


def _toml_group(group: BaseModel, path: str, explain: bool) -> list[str]:
    lines: list[str] = []
    below: list[str] = []
    for name, info in type(group).model_fields.items():
        value = getattr(group, name)
        if isinstance(value, BaseModel):
            below += ["", f"[{path}{name}]", *_toml_group(value, f"{path}{name}.", explain)]
            continue
        if explain:
            lines += ["", f"# {info.description}{_range(info)}"]
        lines.append(f"# {name} =  (None)" if value is None else f"{name} = {_toml_value(value)}")
    return lines + below


def _toml_value(value: Any) -> str:
    if isinstance(value, Path):
        value = str(value)
    return json.dumps(value, ensure_ascii=False)  # booleans, numbers, strings and lists are equal in TOML and JSON


def _range(info: FieldInfo) -> str:
    """Allowed values in brackets: choices, or bounds."""
    choices = [value for value in get_args(info.annotation) if isinstance(value, str)]
    if choices:
        return f" [{', '.join(choices)}]"
    signs = {"ge": ">=", "gt": ">", "le": "<=", "lt": "<"}
    bounds = [
        f"{sign} {getattr(rule, name):g}"
        for rule in info.metadata
        for name, sign in signs.items()
        if hasattr(rule, name)
    ]
    return f" [{', '.join(bounds)}]" if bounds else ""
