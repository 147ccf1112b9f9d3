"""The base of all configuration: frozen groups of values, and the TOML files that contain them."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ConfigDict

from vidtrack.errors import ConfigError


class Group(BaseModel):
    """A group of settings: frozen, unknown names and non-finite numbers are errors."""

    model_config = ConfigDict(frozen=True, extra="forbid", use_attribute_docstrings=True, allow_inf_nan=False)


def read_toml(path: Path, what: str) -> dict[str, Any]:
    """Read a TOML file; `what` names its content in messages. Raises ConfigError if it cannot be read."""
    return parse_toml(read_toml_text(path, what), path)


def read_toml_text(path: Path, what: str) -> str:
    """The text of a TOML file. Raises ConfigError if it cannot be read."""
    try:
        return path.read_text(encoding="utf-8-sig")
    except OSError as error:
        raise ConfigError(f"cannot read {what} {path}: {error.strerror or error}") from None
    except UnicodeDecodeError as error:
        raise ConfigError(f"{path} is not valid TOML: {error}") from None


def parse_toml(text: str, path: Path) -> dict[str, Any]:
    """The content of a TOML file with this text. Raises ConfigError."""
    try:
        return tomllib.loads(text)
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        raise ConfigError(f"{path} is not valid TOML: {error}") from None
