"""The file of a site that is edited: comments and whatever the page does not know stay, and nobody's work is lost."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, MutableMapping
from datetime import date, datetime, time
from hashlib import sha256
from pathlib import Path
from threading import Lock
from typing import Any

import tomlkit
from pydantic import ValidationError
from tomlkit.items import InlineTable

from vidtrack.errors import ConfigError
from vidtrack.output.folder import replacing, writing
from vidtrack.output.lock import by_turns
from vidtrack.traffic.site import Site, faults_of

Tree = dict[str, Any]
"""A site as plain data: what stands in its file, times as text in ISO 8601."""


class ChangedError(ConfigError):
    """The file is no longer the one that was read."""


class SiteFile:
    """A site.toml, there or not yet. `path` is the file itself where the given path is a link."""

    def __init__(self, path: Path) -> None:
        self.path = path.resolve()
        self._saving = Lock()

    def read(self) -> tuple[Tree | None, str]:
        """What is in the file, None where there is none yet, and a digest of it. Raises ConfigError for no site."""
        text, digest = self._text()
        if text is None:
            return None, digest
        tree = tomllib.loads(text)
        self._check(tree)
        return _plain(tree), digest

    def digest(self) -> str:
        """Of the file as it is now."""
        return self._text()[1]

    def save(self, tree: Tree, digest: str) -> str:
        """Write a site in place of the one that `digest` was of; the new digest.

        Raises ChangedError, ConfigError for a tree that is no site, and StoppedEarly if it cannot be written.
        """
        self._check(tree)
        with self._saving, writing(self.path), by_turns(self.path):
            text, now = self._text()
            if now != digest:
                raise ChangedError(
                    f"{self.path.name} was {'deleted' if text is None else 'changed'} by somebody else since it was "
                    "opened here; nothing was saved"
                )
            new = _merged(text or "", _plain(tree)).encode()
            with replacing(self.path) as place:
                place.write_bytes(new)
            return _digest(new)

    def _text(self) -> tuple[str | None, str]:
        try:
            content = self.path.read_bytes()
            text = content.decode("utf-8")
            tomllib.loads(text)
            return text, _digest(content)
        except FileNotFoundError:
            return None, ""
        except OSError as error:
            raise ConfigError(f"cannot read site {self.path}: {error.strerror or error}") from None
        except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
            raise ConfigError(f"{self.path} is not valid TOML: {error}") from None

    def _check(self, tree: Mapping[str, Any]) -> None:
        try:
            Site.model_validate(tree)
        except ValidationError as error:
            raise ConfigError("\n".join(f"{self.path}: {fault.words}" for fault in faults_of(error))) from None


def _digest(content: bytes) -> str:
    return sha256(content).hexdigest()


def _plain(value: Any) -> Any:
    """The value with times as text, and without what is None: TOML has no word for it."""
    if isinstance(value, Mapping):
        return {str(key): _plain(one) for key, one in value.items() if one is not None}
    if isinstance(value, list):
        return [_plain(one) for one in value]
    return value.isoformat() if isinstance(value, (date, time, datetime)) else value


def _merged(text: str, tree: Tree) -> str:
    """The text of a file with what differs from the tree changed in place."""
    document = tomlkit.parse(text)
    _change(document, tree, ())
    merged = tomlkit.dumps(document)
    if not _says(merged, tree):  # the old file has a shape that cannot be changed in place: its comments go
        document = tomlkit.document()
        _change(document, tree, ())
        merged = tomlkit.dumps(document)
    return merged


def _says(text: str, tree: Tree) -> bool:
    try:
        return bool(_plain(tomllib.loads(text)) == tree)
    except tomllib.TOMLDecodeError:
        return False


def _change(table: MutableMapping[str, Any], tree: Tree, path: tuple[str, ...]) -> None:
    for key in [key for key in table if key not in tree]:
        del table[key]
    for key, value in tree.items():
        if isinstance(value, dict) and value and not isinstance(table, InlineTable):
            if not isinstance(table.get(key), MutableMapping):
                table[key] = tomlkit.table(is_super_table=all(isinstance(one, dict) for one in value.values()))
            _change(table[key], value, (*path, key))
        elif key not in table or _plain(tomlkit.item(table[key]).unwrap()) != value:
            table[key] = _time(value) if (*path, key) == ("site", "start") else value


def _time(text: str) -> datetime | str:
    try:
        return datetime.fromisoformat(text)
    except ValueError:
        return text
