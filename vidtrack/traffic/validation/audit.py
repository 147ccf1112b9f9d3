"""What somebody found who looked at counted crossings: verdicts, and how good the counts are by them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from itertools import takewhile
from typing import Any

from vidtrack.traffic.validation.audit_events import CountedEvents, Event, random_order
from vidtrack.traffic.validation.validate import Estimate, proportion

VERDICTS = RIGHT, WRONG_CLASS, WRONG_WAY, DOUBLE, NO_VEHICLE, WRONG, UNSURE = (
    "right", "wrong class", "wrong direction", "double", "no vehicle", "wrong", "cannot tell",
)  # fmt: skip
"""What a counted crossing may be found to be. The page of `vidtrack review` has a key for each."""
MISSED = "missed"
"""Of a vehicle that was not counted."""
COUNTED_WELL = (RIGHT, WRONG_CLASS)
"""A vehicle passed there, in that direction, once."""
FALSE = (WRONG_WAY, DOUBLE, NO_VEHICLE, WRONG)
"""None did."""
_SAME_S = 1.0
"""s; a crossing that was measured again may have moved by so much"""


@dataclass(frozen=True, slots=True)
class Correction:
    """A row of corrections.csv: the verdict about one crossing, or a vehicle that was missed (without a track)."""

    verdict: str
    time_s: float
    gate: str
    direction: str
    run: int | None = None
    track_id: int | None = None


@dataclass(frozen=True, slots=True)
class Audit:
    """Corrections beside the events that they are about.

    verdicts   by the number of the event
    missed     vehicles that no event is of
    homeless   corrections of events that are no longer there
    """

    verdicts: Mapping[int, str]
    missed: tuple[Correction, ...]
    homeless: tuple[Correction, ...]


def audited(events: Sequence[Event], corrections: Sequence[Correction]) -> Audit:
    """Find the event of each correction: the same track, gate and direction, at most a second apart."""
    numbers: dict[tuple[int, int, str, str], list[int]] = {}
    for k, event in enumerate(events):
        numbers.setdefault((event.run, event.track_id, event.gate, event.direction), []).append(k)
    verdicts: dict[int, str] = {}
    missed, homeless = [], []
    for one in corrections:
        if one.verdict == MISSED:
            missed.append(one)
            continue
        key = (-1 if one.run is None else one.run, one.track_id or 0, one.gate, one.direction)
        near = [k for k in numbers.get(key, []) if abs(events[k].time_s - one.time_s) <= _SAME_S]
        if near:
            verdicts[min(near, key=lambda k: abs(events[k].time_s - one.time_s))] = one.verdict
        else:
            homeless.append(one)
    return Audit(verdicts, tuple(missed), tuple(homeless))


@dataclass(frozen=True, slots=True)
class AuditFigures:
    """Crossings of a gate and direction, of a gate, or all.

    counted     by vidtrack
    looked_at   of them, by somebody
    verdicts    how many of each
    false       of these, crossings that there were not, or not in this direction
    missed      vehicles that were noted as missed
    corrected   counted - false + missed; what nobody looked at is taken for right
    sample      of those looked at, how many are a random sample and decided; `right`: of these counted well
    precision   right / sample; None without a sample
    """

    counted: int
    looked_at: int
    verdicts: dict[str, int]
    false: int
    missed: int
    corrected: int
    sample: int
    right: int
    precision: Estimate | None

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        return asdict(self)


def sample_of(order: Iterable[int], audit: Audit) -> list[int]:
    """Numbers of the events that are a random sample of all and were looked at.

    The longest beginning of the random order (see `audit_events.random_order`) that was looked at from end to end.
    What was looked at by doubt is not in it before the order has come to it: it is wrong more often than the rest.
    """
    return list(takewhile(audit.verdicts.__contains__, order))


def figures_of(
    events: Sequence[Event],
    audit: Audit,
    sample: Iterable[int],
    gate: str | None = None,
    direction: str | None = None,
) -> AuditFigures:
    """The figures of all events, of a gate, or of one of its directions; `sample` as by `sample_of`."""

    def ours(one: Event | Correction) -> bool:
        return gate in (None, one.gate) and direction in (None, one.direction)

    verdicts = Counter(verdict for k, verdict in audit.verdicts.items() if ours(events[k]))
    counted = sum(map(ours, events))
    missed = sum(map(ours, audit.missed))
    turned = [events[k] for k, verdict in audit.verdicts.items() if verdict == WRONG_WAY and events[k].gate == gate]
    came = sum(one.direction != direction for one in turned) if direction is not None else verdicts[WRONG_WAY]
    false = sum(verdicts[verdict] for verdict in FALSE)
    decided = [audit.verdicts[k] for k in sample if ours(events[k]) and audit.verdicts[k] != UNSURE]
    right = sum(verdict in COUNTED_WELL for verdict in decided)
    return AuditFigures(
        counted,
        verdicts.total(),
        {verdict: verdicts[verdict] for verdict in VERDICTS},
        false,
        missed,
        counted - false + came + missed,
        len(decided),
        right,
        proportion(right, len(decided)) if decided else None,
    )


@dataclass(frozen=True, slots=True)
class Reviewed:
    """The figures of each gate, and of all; `homeless`: corrections of events that are no longer there."""

    gates: dict[str, AuditFigures]
    pooled: AuditFigures
    homeless: int

    @property
    def rows(self) -> list[tuple[str, AuditFigures]]:
        """Name and figures of each gate, and of all."""
        return [*self.gates.items(), ("all", self.pooled)]

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        return asdict(self)


def review_of(counted: CountedEvents, audit: Audit) -> Reviewed:
    """What the verdicts say about the counts."""
    events = counted.events
    sample = sample_of(random_order(events).tolist(), audit)
    gates = {gate: figures_of(events, audit, sample, gate) for gate in counted.gates}
    return Reviewed(gates, figures_of(events, audit, sample), len(audit.homeless))
