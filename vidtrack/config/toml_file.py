"""Reading TOML files, with errors in words."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

from vidtrack.errors import ConfigError


def read_toml(path: Path, what: str) -> dict[str, Any]:
    """The tables of a file; `what` it holds, for the message. Raises ConfigError if it cannot be read or is no TOML."""
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise ConfigError(f"cannot read {what} {path}: {error.strerror or error}") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ConfigError(f"{path} is not valid TOML: {error}") from None
