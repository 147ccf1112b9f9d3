"""The finished runs of a batch, by site and day: what is measured together."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

from vidtrack.errors import ConfigError, SourceError
from vidtrack.run.batch.index import DONE, INDEX, Row, rows_of
from vidtrack.run.batch.place import Place, place_of
from vidtrack.run.batch.task import RESULTS
from vidtrack.traffic.metres import SITE_COPY
from vidtrack.traffic.site import read_site

UNDATED = "undated"


def is_archive(text: str) -> bool:
    """Whether this is the place of a batch."""
    return "://" in text or (Path(text) / INDEX).is_file()


@dataclass(frozen=True, slots=True)
class Portion:
    """The runs of one site on one day.

    site  its name
    day   date in the zone of the starts; `undated-FOLDER` for a run whose start is not known, which is alone
    rows  of the index, in order of their starts
    """

    place: Place
    site: str
    day: str
    rows: tuple[Row, ...]

    @contextmanager
    def runs(self) -> Iterator[list[str]]:
        """The folders of the runs on this machine, as `vidtrack measure` takes them: FOLDER or FOLDER@TIME."""
        with ExitStack() as stack:
            folders = [stack.enter_context(self.place.local(f"{RESULTS}/{row.folder}")) for row in self.rows]
            times = ["" if row.start is None else f"@{row.start}" for row in self.rows]
            yield [f"{folder}{time}" for folder, time in zip(folders, times, strict=True)]


def portions(text: str, site: Path | None) -> list[Portion]:
    """The portions of a batch with a site, in order of site and day.

    site  of all runs; None: the one that each was tracked with

    Raises SourceError where nothing is done, or nothing has a site; ConfigError for two sites with one folder.
    """
    place = place_of(text)
    rows = [row for row in rows_of(place.read(INDEX), place.shown).values() if row.state == DONE]
    if not rows:
        raise SourceError(f"{place.shown} has no finished runs; see {INDEX} there")
    named: dict[str, str] = {}
    groups: dict[tuple[str, str], list[Row]] = {}
    for row in rows:
        key = str(site) if site is not None else row.site
        if key is None:
            continue
        if key not in named:
            named[key] = read_site(site).camera.name if site is not None else _site_name(place, row)
        groups.setdefault((named[key], _day(row)), []).append(row)
    if not groups:
        raise SourceError(f"no run in {place.shown} was tracked with a site; give --site SITE.toml")
    _refuse_same_folder({name for name, _ in groups})
    return [
        Portion(place, name, day, tuple(sorted(group, key=_order))) for (name, day), group in sorted(groups.items())
    ]


def _site_name(place: Place, row: Row) -> str:
    """The name of the site that a run was tracked with."""
    with place.local(f"{RESULTS}/{row.folder}") as folder:
        return read_site(folder / SITE_COPY).camera.name


def _day(row: Row) -> str:
    return f"{UNDATED}-{row.folder}" if row.start is None else datetime.fromisoformat(row.start).date().isoformat()


def _order(row: Row) -> tuple[float, str]:
    return 0.0 if row.start is None else datetime.fromisoformat(row.start).timestamp(), row.source


def folder_name(text: str) -> str:
    """A name of a site or a day as that of a folder."""
    return re.sub(r"[^\w.-]+", "_", text).lstrip(".") or "site"


def _refuse_same_folder(sites: Iterable[str]) -> None:
    """Raise ConfigError for two sites whose measures would have the same folder."""
    owner: dict[str, str] = {}
    for site in sorted(sites):
        folder = folder_name(site)
        if folder in owner:
            raise ConfigError(f"the sites {owner[folder]} and {site} would have one folder, {folder}; rename one")
        owner[folder] = site
