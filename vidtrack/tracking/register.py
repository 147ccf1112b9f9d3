"""The register of tracks: identity and history of each row of the bank."""

from __future__ import annotations

import numpy as np

from vidtrack.scan import TENTATIVE, Floats, Ints


class Register:
    """Who the rows are; one row a track, in the order of the estimator's rows.

    id, status, born_s, updated_s (last evidence), history (hits of the last 63 scans as bits, newest lowest),
    start (T, d) position at birth, box (T, 4) left, top, width, height relative to the position,
    group and group_since_s (tracks on one blob), existence, run, label (class last seen, -1 unknown).
    """

    STATE = ("next_id", "id", "status", "born_s", "updated_s", "history", "start", "box", "group", "group_since_s",
             "existence", "run", "label")  # fmt: skip

    def __init__(self, dim: int) -> None:
        self.next_id = 1
        self.id = np.empty(0, np.int64)
        self.status = np.empty(0, np.int8)
        self.born_s = np.empty(0)
        self.updated_s = np.empty(0)
        self.history = np.empty(0, np.int64)
        self.start = np.empty((0, dim))
        self.box = np.empty((0, 4))
        self.group = np.empty(0, np.int64)
        self.group_since_s = np.empty(0)
        self.existence = np.empty(0)
        self.run = np.empty(0, np.int64)
        self.label = np.empty(0, np.int64)

    def __len__(self) -> int:
        return len(self.id)

    def append(
        self, t: float, position: Floats, box: Floats, existence: float, run: Ints, label: Ints | None = None
    ) -> Ints:
        """Register new tentative tracks; returns their ids."""
        count = len(position)
        ids = np.arange(self.next_id, self.next_id + count)
        self.next_id += count
        new = {
            "id": ids,
            "status": np.full(count, TENTATIVE, np.int8),
            "born_s": np.full(count, t),
            "updated_s": np.full(count, t),
            "history": np.ones(count, np.int64),
            "start": position,
            "box": box,
            "group": np.full(count, -1),
            "group_since_s": np.full(count, np.nan),
            "existence": np.full(count, existence),
            "run": run,
            "label": np.full(count, -1) if label is None else label,
        }
        for name, values in new.items():
            setattr(self, name, np.concatenate([getattr(self, name), values]))
        return ids

    def rename(self, rows: np.ndarray) -> tuple[Ints, Ints]:
        """Give these rows new ids, one for each old one; returns the old ids and the new ones."""
        old, place = np.unique(self.id[rows], return_inverse=True)
        new = self.next_id + np.arange(len(old))
        self.id[rows] = new[place]
        self.next_id += len(old)
        return old, new

    def keep(self, rows: np.ndarray) -> None:
        """Drop all rows but these indices."""
        for name in self.STATE[1:]:
            setattr(self, name, getattr(self, name)[rows])
