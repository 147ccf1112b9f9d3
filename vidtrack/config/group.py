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
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise ConfigError(f"cannot read {what} {path}: {error.strerror or error}") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ConfigError(f"{path} is not valid TOML: {error}") from None
