"""What a pipeline remembers, as plain data: saved to a file and put back, so that it goes on as if it had not stopped.

Whoever remembers something names it in `STATE`: attributes that are arrays, numbers, named tuples of arrays, or
others with a STATE. Settings are not state; they come from the user each time.
"""

from __future__ import annotations

import json
import os
import zipfile
from contextlib import suppress
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np

from vidtrack.errors import ConfigError, FormatError

State = dict[str, Any]
"""Dotted names of attributes, with arrays or what JSON can hold as values."""

_PLAIN = "plain"


def gather(thing: Any, prefix: str = "") -> State:
    """Copies of everything the thing remembers. Raises ConfigError for a part that cannot be saved."""
    found: State = {}
    for name in _names(thing):
        value = getattr(thing, name)
        if value is None or isinstance(value, bool | int | float | str):
            found[prefix + name] = value
        elif isinstance(value, np.ndarray):
            found[prefix + name] = value.copy()
        elif isinstance(value, np.generic):
            found[prefix + name] = value.item()
        elif isinstance(value, tuple):
            found |= _unpacked(prefix + name, value)
        else:
            found |= gather(value, f"{prefix}{name}.")
    return found


def restore(thing: Any, state: State, prefix: str = "") -> None:
    """Put back what `gather` found in a thing made with the same settings. Raises FormatError if it does not fit."""
    for name in _names(thing):
        value = getattr(thing, name)
        if hasattr(value, "STATE"):
            restore(value, state, f"{prefix}{name}.")
        elif hasattr(value, "_fields"):
            setattr(thing, name, type(value)(*(_get(state, f"{prefix}{name}.{field}") for field in value._fields)))
        else:
            found = _get(state, prefix + name)
            _check(prefix + name, value, found)
            setattr(thing, name, tuple(found) if isinstance(found, list) else found)


def write_state(path: Path, state: State) -> None:
    """Write a state so that the file is the old one or the new one, whatever happens. Raises OSError."""
    arrays = {name: value for name, value in state.items() if isinstance(value, np.ndarray)}
    plain = {name: value for name, value in state.items() if name not in arrays}
    block = BytesIO()
    np.savez(block, allow_pickle=False, **{_PLAIN: np.frombuffer(json.dumps(plain).encode(), np.uint8)}, **arrays)
    new = path.with_name(path.name + ".new")
    try:
        with open(new, "wb") as file:
            file.write(block.getbuffer())
            file.flush()
            os.fsync(file.fileno())
        os.replace(new, path)
    except OSError:
        with suppress(OSError):
            new.unlink(missing_ok=True)
        raise


def read_state(path: Path) -> State:
    """What `write_state` wrote. Raises FormatError."""
    try:
        with np.load(path, allow_pickle=False) as file:
            state: State = {name: file[name] for name in file.files}
        plain = json.loads(state.pop(_PLAIN).tobytes())
        return {**state, **plain}
    except OSError as error:
        raise FormatError(f"cannot read the state {path}: {error.strerror or error}") from None
    except (ValueError, KeyError, AttributeError, EOFError, zipfile.BadZipFile) as error:
        raise FormatError(f"{path} is not a saved state ({error}); remove it to start anew") from None


def _unpacked(name: str, value: tuple[Any, ...]) -> State:
    """A named tuple of arrays field by field; any other as the list that JSON makes of it."""
    if not hasattr(value, "_fields"):
        return {name: list(value)}
    return {f"{name}.{field}": plane.copy() for field, plane in zip(value._fields, value, strict=True)}


def _check(name: str, now: Any, found: Any) -> None:
    """Compiled code would trust an array of another kind. There may be any number of rows, and 0 is no shape yet."""
    if not isinstance(now, np.ndarray):
        return
    same_kind = isinstance(found, np.ndarray) and found.dtype == now.dtype and found.ndim == now.ndim
    if not same_kind or any(size not in (0, new) for size, new in zip(now.shape[1:], found.shape[1:], strict=True)):
        raise FormatError(f"the saved state's {name} does not fit: other settings made it; give it those, or remove it")


def _names(thing: Any) -> tuple[str, ...]:
    names: tuple[str, ...] | None = getattr(thing, "STATE", None)
    if names is None:
        raise ConfigError(f"{type(thing).__name__} cannot be saved; choose another method, or leave out the state")
    return names


def _get(state: State, name: str) -> Any:
    try:
        return state[name]
    except KeyError:
        raise FormatError(
            f"the saved state has no {name}: other settings made it; give it those, or remove it"
        ) from None
