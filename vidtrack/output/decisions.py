"""decisions.csv: the reasons of each association and of each change of status."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.csv

from vidtrack.decision import Choices, Event
from vidtrack.errors import FormatError
from vidtrack.output.linefile import LineFile
from vidtrack.output.sink import Step

HEADER = "time_s,track_id,event,measurement,weight,d2,gate,runner_up,runner_up_d2,candidates,reason\n"


class DecisionLog:
    """Sink that writes one row per track and scan (event "update" or "miss") and one per change of status.

    Tentative tracks are included, with the reasons of their deletion.

    index  name of the first column, "frame" or "scan"
    """

    def __init__(self, path: Path, index: str = "frame") -> None:
        self._file = LineFile(path, f"{index},{HEADER}")

    def step(self, step: Step) -> None:
        """Write the decisions of one scan."""
        start = f"{step.index},{step.time_s:.6f}"
        choices = () if step.tracks.choices is None else _choice_rows(step.tracks.choices)
        rows = [*choices, *map(_event_row, step.tracks.events)]
        self._file.add("".join(f"{start},{row}\n" for row in rows))

    def close(self) -> None:
        """Write the rest and close the file."""
        self._file.close()


def _choice_rows(choices: Choices) -> list[str]:
    columns = (
        choices.track_id,
        choices.measurement,
        choices.weight,
        choices.d2,
        choices.gate,
        choices.runner_up,
        choices.runner_up_d2,
        choices.candidates,
        choices.candidates_weight,
        choices.candidates_d2,
    )
    return [
        f"{track},{'miss' if chosen < 0 else 'update'},{_index(chosen)},{_real(weight)},{_real(d2)},{_real(gate)},"
        f"{_index(second)},{_real(second_d2)},{_candidates(*candidates)},"
        for track, chosen, weight, d2, gate, second, second_d2, *candidates in zip(
            *(c.tolist() for c in columns), strict=True
        )
    ]


def _event_row(event: Event) -> str:
    reason = event.reason.replace('"', "'")
    return f'{event.track_id},{event.kind},,,,,,,,"{reason}"'


def _candidates(measurements: list[int], weights: list[float], d2: list[float]) -> str:
    """Candidates as measurement:weight:d2, separated by semicolons."""
    found = zip(measurements, weights, d2, strict=True)
    return ";".join(f"{j}:{_real(weight)}:{_real(distance)}" for j, weight, distance in found if j >= 0)


def _index(value: int) -> str:
    return "" if value < 0 else str(value)


def _real(value: float) -> str:
    return "" if value != value else f"{value:.4g}"


def read_decisions(path: Path, track_id: int, begin_s: float, end_s: float) -> list[dict[str, Any]]:
    """Rows of decisions.csv of one track: those of a span of time, and its changes of status before.

    Raises FormatError for a damaged file.
    """
    kinds = {"time_s": pa.float64(), "track_id": pa.int64(), "event": pa.string(), "reason": pa.string()}
    rows: list[dict[str, Any]] = []
    try:
        with pyarrow.csv.open_csv(path, convert_options=pyarrow.csv.ConvertOptions(column_types=kinds)) as reader:
            for batch in reader:
                times = batch.column("time_s")
                ours = pc.and_(pc.equal(batch.column("track_id"), track_id), pc.less_equal(times, end_s))
                rows += batch.filter(ours).to_pylist()
                if len(times) and times[-1].as_py() > end_s:
                    break
    except (pa.ArrowInvalid, pa.ArrowKeyError, KeyError) as error:
        raise FormatError(f"{path} is damaged: {error}") from None
    return [row for row in rows if row["time_s"] >= begin_s or row["event"] not in ("update", "miss")]
