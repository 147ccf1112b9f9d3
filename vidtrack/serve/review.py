"""The page on which counted crossings are looked at one by one."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any

from starlette.applications import Starlette
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import FileResponse, JSONResponse, PlainTextResponse, Response
from starlette.routing import Mount, Route
from starlette.staticfiles import StaticFiles

from vidtrack.errors import Error
from vidtrack.output.clips import Clip, Clips
from vidtrack.output.corrections import CorrectionsFile
from vidtrack.output.decisions import read_decisions
from vidtrack.traffic.validation.audit import (
    MISSED,
    VERDICTS,
    Audit,
    AuditFigures,
    Correction,
    audited,
    figures_of,
    sample_of,
)
from vidtrack.traffic.validation.audit_events import CountedEvents, Event, random_order

_STATIC = Path(__file__).with_name("static")
_ROUND_S = 0.5
"""s before and after a crossing, of its decisions"""


class Review:
    """The page over the counted crossings of a folder.

    name   of the folder
    order  numbers of the events to look at; `sampled`: they are a random sample

    Of several tabs, one that does not know the newest verdicts is refused: every change carries the number of changes
    before it.
    """

    def __init__(
        self,
        name: str,
        counted: CountedEvents,
        file: CorrectionsFile,
        clips: Clips,
        order: Iterable[int],
        sampled: bool,
    ) -> None:
        self._name, self._counted, self._file, self._clips = name, counted, file, clips
        self._order, self._sampled = list(order), sampled
        self._random = random_order(counted.events).tolist()
        self._changes = 0

    def app(self) -> Starlette:
        """The ASGI application."""
        return Starlette(
            routes=[
                Route("/", self.page),
                Route("/events", self.events),
                Route("/clips/{number:int}.jpg", self.clip),
                Route("/thumbs/{number:int}.jpg", self.thumb),
                Route("/decisions/{number:int}", self.decisions),
                Route("/verdict", self.verdict, methods=["POST"]),
                Route("/missed", self.missed, methods=["POST"]),
                Mount("/static", StaticFiles(directory=_STATIC)),
            ],
            exception_handlers={Error: _told},
        )

    async def page(self, request: Request) -> Response:
        """The HTML page, whose script requests the other routes."""
        return FileResponse(_STATIC / "review.html")

    async def events(self, request: Request) -> Response:
        """All that the page shows of events, in the order to look at them, and the state."""
        events = self._counted.events
        return JSONResponse(
            {
                "name": self._name,
                "sampled": self._sampled,
                "total": len(events),
                "ways": self._counted.ways,
                "zone": self._counted.clock.zone,
                "events": [self._plain(k) for k in self._order],
                "no_clips": await asyncio.to_thread(self._clips.why_not),
                "state": self._state(),
            }
        )

    async def clip(self, request: Request) -> Response:
        """The clip of an event; in headers how many pictures lie side by side, and in which one it passes."""
        clip = await self._cut(request)
        headers = {"Clip-Frames": str(clip.frames), "Clip-Moment": str(clip.moment)}
        return Response(clip.strip, media_type="image/jpeg", headers=headers)

    async def thumb(self, request: Request) -> Response:
        """One small picture of an event."""
        return Response((await self._cut(request)).thumb, media_type="image/jpeg")

    async def decisions(self, request: Request) -> Response:
        """What the tracker decided about the track around the event; null without a decision log."""
        event = self._event(request.path_params["number"])
        recording = self._counted.recording_of(event)
        path = None if recording is None else recording.folder / "decisions.csv"
        if recording is None or path is None or not path.is_file():
            return JSONResponse(None)
        t = event.time_s - recording.offset_s
        rows = await asyncio.to_thread(read_decisions, path, event.track_id, t - _ROUND_S, t + _ROUND_S)
        return JSONResponse([row | {"time_s": row["time_s"] + recording.offset_s} for row in rows])

    async def verdict(self, request: Request) -> Response:
        """Note a verdict {changes, number, verdict}, or take it back (null); the answer is the new state."""
        change = await self._change(request)
        number: Any = change.get("number")
        verdict = change.get("verdict")
        self._event(number)  # refuses one that is not there
        if verdict is not None and verdict not in VERDICTS:
            raise HTTPException(400, f"{verdict!r} is no verdict")
        audit = self._audit()
        verdicts = {k: one for k, one in audit.verdicts.items() if k != number}
        if verdict is not None:
            verdicts[number] = verdict
        self._save(replace(audit, verdicts=verdicts))
        return JSONResponse(self._state())

    async def missed(self, request: Request) -> Response:
        """Note a missed vehicle {changes, time_s, gate, direction}, or take one back: {changes, number}."""
        change = await self._change(request)
        audit = self._audit()
        noted = list(audit.missed)
        if "number" in change:
            if change["number"] not in range(len(noted)):
                raise HTTPException(404, "no such missed vehicle")
            del noted[change["number"]]
        else:
            noted.append(self._noted(change))
        self._save(replace(audit, missed=tuple(noted)))
        return JSONResponse(self._state())

    def _noted(self, change: dict[str, Any]) -> Correction:
        time_s, gate, direction = (change.get(name) for name in ("time_s", "gate", "direction"))
        if not isinstance(time_s, int | float) or not math.isfinite(time_s):
            raise HTTPException(400, "the time is no number of seconds")
        if not isinstance(gate, str) or direction not in self._counted.ways.get(gate, ()):
            raise HTTPException(400, "no such gate and direction")
        return Correction(MISSED, float(time_s), gate, str(direction))

    async def _change(self, request: Request) -> dict[str, Any]:
        try:
            change = await request.json()
        except ValueError:
            change = None
        if not isinstance(change, dict):
            raise HTTPException(400, "this is no change")
        if change.get("changes") != self._changes:
            raise HTTPException(409, "another tab changed something meanwhile; this one is loaded again")
        return change

    def _event(self, number: Any) -> Event:
        if not isinstance(number, int) or number not in range(len(self._counted.events)):
            raise HTTPException(404, "no such event")
        return self._counted.events[number]

    async def _cut(self, request: Request) -> Clip:
        event = self._event(request.path_params["number"])
        return await asyncio.to_thread(self._clips.clip, event)

    def _audit(self) -> Audit:
        return audited(self._counted.events, self._file.rows)

    def _save(self, audit: Audit) -> None:
        events = self._counted.events
        looked_at = (
            Correction(verdict, one.time_s, one.gate, one.direction, one.run, one.track_id)
            for one, verdict in ((events[k], verdict) for k, verdict in audit.verdicts.items())
        )
        rows = sorted([*looked_at, *audit.missed, *audit.homeless], key=lambda one: (one.time_s, one.gate))
        self._file.replace(rows)
        self._changes += 1

    def _plain(self, number: int) -> dict[str, Any]:
        """An event for JSON."""
        event = self._counted.events[number]
        values = {name: getattr(event, name) for name in event.__slots__}
        known = {name: value if value == value else None for name, value in values.items()}  # NaN is not itself
        clock = self._counted.clock.moment(event.time_s)
        return {"number": number, "doubt": round(event.doubt, 4), "clock": clock, **known}

    def _state(self) -> dict[str, Any]:
        """What changes with every verdict."""
        audit, events = self._audit(), self._counted.events
        sample, clock = sample_of(self._random, audit), self._counted.clock.moment

        def figures(gate: str | None = None, direction: str | None = None) -> AuditFigures:
            return figures_of(events, audit, sample, gate, direction)

        ways = [(gate, way) for gate, pair in self._counted.ways.items() for way in pair]
        return {
            "changes": self._changes,
            "verdicts": {str(k): verdict for k, verdict in audit.verdicts.items()},
            "missed": [
                {"time_s": one.time_s, "clock": clock(one.time_s), "gate": one.gate, "direction": one.direction}
                for one in audit.missed
            ],
            "homeless": len(audit.homeless),
            "all": figures().as_dict(),
            "ways": [{"gate": gate, "direction": way, **figures(gate, way).as_dict()} for gate, way in ways],
        }


async def _told(request: Request, error: Exception) -> Response:
    """An error of the user's input, in its words."""
    return PlainTextResponse(f"{error}\n", 404 if request.method == "GET" else 409)
