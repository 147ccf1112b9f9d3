"""The register of tracks: identity and history of each row of the bank."""

from __future__ import annotations

import numpy as np

from vidtrack.scan import Floats, Ints, Status


class Register:
    """Who the rows are; one row a track, in the order of the estimator's rows.

    id, status, born_s, updated_s (last evidence), history (hits of the last 63 scans as bits, newest lowest),
    start (T, d) position at birth, box (T, 4) left, top, width, height relative to the position,
    group and group_since_s (tracks on one blob), existence, run.
    """

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

    def __len__(self) -> int:
        return len(self.id)

    def append(self, t: float, position: Floats, box: Floats, existence: float, run: Ints) -> Ints:
        """Register new tentative tracks; returns their ids."""
        count = len(position)
        ids = np.arange(self.next_id, self.next_id + count)
        self.next_id += count
        new = {
            "id": ids,
            "status": np.full(count, Status.TENTATIVE, np.int8),
            "born_s": np.full(count, t),
            "updated_s": np.full(count, t),
            "history": np.ones(count, np.int64),
            "start": position,
            "box": box,
            "group": np.full(count, -1),
            "group_since_s": np.full(count, np.nan),
            "existence": np.full(count, existence),
            "run": run,
        }
        for name, values in new.items():
            setattr(self, name, np.concatenate([getattr(self, name), values]))
        return ids

    def keep(self, rows: np.ndarray) -> None:
        """Drop all rows but these indices."""
        for name in ("id", "status", "born_s", "updated_s", "history", "start", "box", "group", "group_since_s",
                     "existence", "run"):  # fmt: skip
            setattr(self, name, getattr(self, name)[rows])
