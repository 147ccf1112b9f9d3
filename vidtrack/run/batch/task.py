"""The unit of work of a batch, as plain data that any process can be handed."""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from importlib.metadata import version
from typing import Any, Literal

from vidtrack.run.batch.place import SLICES
from vidtrack.run.slices.cuts import Cut

RESULTS = "results"
"""Folder of the finished runs in a place."""

VERSION = version("vidtrack")

Outcome = dict[str, Any]
"""What came of a task: `done` with the numbers of the run, or `cuts` of a long file, or `sliced`, or `error`.

With `error`, `again` says whether another attempt may help, and `unreadable` whether the source is at fault.
"""


@dataclass(frozen=True, slots=True)
class Task:
    """A file, one slice of it, or the stitching of all its slices.

    out       place of the batch
    name      folder of the results
    address   of the source
    about     what is written beside the results: the source's row of the index
    settings  of the run, nested
    key       digest of source, settings and version
    slice_s, warm_s   lengths of slices and of their warm-up [s]; slice_s 0: never cut; warm_s None: each slice goes on
             from the state of the one before it
    patience_s   longest time without a frame
    cuts      all slices of the file
    number    of the slice
    """

    kind: Literal["file", "slice", "stitch"]
    out: str
    name: str
    address: str
    about: dict[str, Any]
    settings: dict[str, Any]
    key: str
    slice_s: float
    warm_s: float | None
    patience_s: float
    cuts: tuple[Cut, ...] = ()
    number: int = 0
    version: str = VERSION

    @property
    def result(self) -> str:
        """Folder of the results in the place."""
        return f"{RESULTS}/{self.name}"

    @property
    def slices(self) -> str:
        """Folder of the slices in the place; other settings have another one."""
        return f"{SLICES}/{self.name}/{self.key}"

    def slice_folder(self, number: int) -> str:
        """Folder of one slice in the place."""
        return f"{self.slices}/{number:05d}"

    def slice(self, number: int) -> Task:
        """The task of one slice."""
        return replace(self, kind="slice", number=number)

    def as_dict(self) -> dict[str, Any]:
        """As JSON has it."""
        return asdict(self)

    @classmethod
    def of(cls, told: dict[str, Any]) -> Task:
        """The task in `as_dict`."""
        return cls(**told | {"cuts": tuple(Cut(**cut) for cut in told["cuts"])})
