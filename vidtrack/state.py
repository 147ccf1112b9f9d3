"""Saves the state of a pipeline to a file and restores it, so that a run continues with the same results.

A class lists its state in `STATE`: names of attributes that are arrays, numbers, named tuples of arrays, objects with a
STATE, or tuples of such objects. Settings are not part of the state; the user gives them each time. A class to which
attributes were added since states of it are kept lists them in `ADDED`, with a function that gives the value from the
restored object where a state of an older version has none.
"""

from __future__ import annotations

import json
import os
import struct
import zipfile
import zlib
from contextlib import suppress
from io import BytesIO
from pathlib import Path
from tokenize import TokenError
from typing import Any

import numpy as np

from vidtrack.errors import ConfigError, FormatError

State = dict[str, Any]
"""Dotted names of attributes; values are arrays or JSON data."""

_PLAIN = "plain"
_DAMAGE = (
    *(ValueError, KeyError, AttributeError, EOFError, RuntimeError, MemoryError),
    *(zipfile.BadZipFile, zlib.error, struct.error, TokenError),
)
"""Errors of NumPy and zipfile for a file that is not a saved state."""


def gather(thing: Any, prefix: str = "") -> State:
    """A copy of the object's state. Raises ConfigError for a part that cannot be saved."""
    found: State = {}
    for name in _names(thing):
        value = getattr(thing, name)
        if value is None or isinstance(value, bool | int | float | str):
            found[prefix + name] = value
        elif isinstance(value, np.ndarray):
            found[prefix + name] = value.copy()
        elif isinstance(value, np.generic):
            found[prefix + name] = value.item()
        elif _is_of_parts(value):
            for k, part in enumerate(value):
                found |= gather(part, f"{prefix}{name}.{k}.")
        elif isinstance(value, tuple):
            found |= _unpacked(prefix + name, value)
        else:
            found |= gather(value, f"{prefix}{name}.")
    return found


def restore(thing: Any, state: State) -> None:
    """Set an object's state to one gathered with the same settings. Raises FormatError if it does not fit."""
    left = state.keys() - _restored(thing, state, "")
    if left:
        raise FormatError(
            f"nothing here takes the saved state's {min(left)}: other settings or another version made it; "
            "give it those, or remove it"
        )


def write_state(path: Path, state: State) -> None:
    """Write a state atomically: the file is the old one or the new one. Raises OSError."""
    arrays = {name: value for name, value in state.items() if isinstance(value, np.ndarray)}
    plain = {name: value for name, value in state.items() if name not in arrays}
    block = BytesIO()
    with zipfile.ZipFile(block, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:  # np.savez: level 6
        for name, array in {_PLAIN: np.frombuffer(json.dumps(plain).encode(), np.uint8), **arrays}.items():
            with archive.open(f"{name}.npy", "w", force_zip64=True) as member:
                np.lib.format.write_array(member, array, allow_pickle=False)
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
    """Read a state written by `write_state`. Raises FormatError."""
    try:
        with np.load(path, allow_pickle=False) as file:
            state: State = {name: file[name] for name in file.files}
        plain = json.loads(state.pop(_PLAIN).tobytes())
        return {**state, **plain}
    except OSError as error:
        raise FormatError(f"cannot read the state {path}: {error.strerror or error}") from None
    except _DAMAGE:
        raise FormatError(f"{path} is not a saved state, or it is damaged; remove it to start anew") from None


def _restored(thing: Any, state: State, prefix: str) -> set[str]:
    """Set the state of an object and its parts; returns the names used."""
    used = set()
    for name in _names(thing):
        value = getattr(thing, name)
        if hasattr(value, "STATE"):
            used |= _restored(value, state, f"{prefix}{name}.")
        elif _is_of_parts(value):
            for k, part in enumerate(value):
                used |= _restored(part, state, f"{prefix}{name}.{k}.")
        elif hasattr(value, "_fields"):
            names = [f"{prefix}{name}.{field}" for field in value._fields]
            setattr(thing, name, type(value)(*(_get(state, each) for each in names)))
            used |= set(names)
        elif prefix + name not in state and name in getattr(thing, "ADDED", ()):
            setattr(thing, name, thing.ADDED[name](thing))
        else:
            found = _get(state, prefix + name)
            _check(prefix + name, value, found)
            setattr(thing, name, tuple(found) if isinstance(found, list) else found)
            used.add(prefix + name)
    return used


def _is_of_parts(value: Any) -> bool:
    """Whether the value is a tuple of objects with a STATE."""
    return isinstance(value, tuple) and len(value) > 0 and all(hasattr(part, "STATE") for part in value)


def _unpacked(name: str, value: tuple[Any, ...]) -> State:
    """A named tuple of arrays by field; any other tuple as a list, as in JSON."""
    if not hasattr(value, "_fields"):
        return {name: list(value)}
    return {f"{name}.{field}": plane.copy() for field, plane in zip(value._fields, value, strict=True)}


def _check(name: str, now: Any, found: Any) -> None:
    """Raise FormatError unless `found` is an array of the type of `now`, which compiled code does not check.

    The number of rows may differ, and other axes if they have length 0 in `now`.
    """
    if not isinstance(now, np.ndarray):
        return
    same_kind = isinstance(found, np.ndarray) and found.dtype == now.dtype and found.ndim == now.ndim
    if not same_kind or any(size not in (0, new) for size, new in zip(now.shape[1:], found.shape[1:], strict=True)):
        raise FormatError(
            f"the saved state's {name} does not fit: other settings or another version made it; remove it"
        )


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
            f"the saved state has no {name}: other settings or another version made it; give it those, or remove it"
        ) from None
