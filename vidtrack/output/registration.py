"""registration.csv: the biases of several radars as they become known, one row per radar and scan."""

from __future__ import annotations

from pathlib import Path

from vidtrack.output.linefile import LineFile
from vidtrack.output.sink import Step
from vidtrack.radar.network.network import Network


class RegistrationTable:
    """Sink that writes the biases after each scan, with their standard deviations; empty without a registration."""

    def __init__(self, path: Path, network: Network) -> None:
        self._network = network
        names = list(next(iter(network.as_dict().values())))
        self._columns = [name for name in names if not name.endswith("_observed")]
        self._file = LineFile(path, ",".join(("scan", "time_s", "radar", *self._columns)) + "\n")

    def step(self, step: Step) -> None:
        """Write a row for each radar."""
        rows = self._network.as_dict().items()
        self._file.add(
            "".join(
                ",".join(
                    (str(step.index), f"{step.time_s:.6f}", radar, *(f"{values[name]:g}" for name in self._columns))
                )
                + "\n"
                for radar, values in rows
            )
        )

    def close(self) -> None:
        """Write the rest."""
        self._file.close()
