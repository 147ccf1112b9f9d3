"""From sources and settings to tasks."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cache
from hashlib import sha256
from pathlib import Path
from typing import Any

from vidtrack.config.inputs import Input
from vidtrack.config.load import load
from vidtrack.config.settings import Settings
from vidtrack.recording.source import is_recording
from vidtrack.run.batch.batch import about
from vidtrack.run.batch.index import Row
from vidtrack.run.batch.sources import Source
from vidtrack.run.batch.task import VERSION, Task
from vidtrack.traffic.site import read_site


@dataclass(frozen=True, slots=True)
class Plan:
    """How all sources of a batch are tracked.

    out          place of the batch
    config_file, given   of the settings, see `config.load`
    slice_s, warm_s      lengths of slices and of their warm-up [s]; slice_s 0: no file is cut; warm_s None: each
                         slice goes on from the state of the one before it
    patience_s   longest time without a frame [s]
    """

    out: str
    config_file: Path | None
    given: tuple[str | tuple[str, Any], ...]
    slice_s: float
    warm_s: float | None
    patience_s: float

    def tasks(self, sources: Iterable[Source]) -> Iterator[Task]:
        """A task for each source. Raises ConfigError for settings or a site that cannot be used."""
        loaded = cache(self._settings)
        for source in sources:
            settings, digest = loaded(source.settings, source.site, _kind(source.address))
            site = settings["output"]["site"]
            start = None if source.start is None else source.start.isoformat()
            row = Row(source.shown, source.name, site, start, bytes=source.size, stamp=source.stamp)
            what = digest, source.size, source.stamp, VERSION, self.slice_s, self.warm_s if self.slice_s else None
            key = sha256(json.dumps(what).encode()).hexdigest()[:16]
            yield Task(
                "file", self.out, source.name, source.address, about(row), settings, key,
                self.slice_s, self.warm_s, self.patience_s,
            )  # fmt: skip

    def _settings(self, more: tuple[str, ...], site: str | None, kind: Input) -> tuple[dict[str, Any], str]:
        """The settings of a source, and a digest of them and of the content of its site and mask."""
        own = [*self.given, *more, *([("output.site", site)] if site is not None else [])]
        settings = _at_root(load(self.config_file, own, kind=kind))
        if settings.output.site is not None:
            read_site(settings.output.site)  # refused before anything is begun
        files = (settings.output.site, settings.source.mask)
        told = settings.model_dump(mode="json")
        contents = [
            sha256(path.read_bytes()).hexdigest() if path is not None and path.is_file() else "" for path in files
        ]
        return told, sha256(json.dumps([told, contents], sort_keys=True).encode()).hexdigest()


def _kind(address: str) -> Input:
    """The kind of a source, which may be far away."""
    if address.lower().endswith(".txt"):
        return Input.DETECTIONS
    return Input.RECORDING if is_recording(address) else Input.VIDEO


def _at_root(settings: Settings) -> Settings:
    """The settings with paths from the root: a worker has another working folder."""
    output, source = settings.output, settings.source
    if output.site is not None:
        output = output.model_copy(update={"site": output.site.absolute()})
    if source.mask is not None:
        source = source.model_copy(update={"mask": source.mask.absolute()})
    return settings.model_copy(update={"output": output, "source": source})
