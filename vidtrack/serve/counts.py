"""The counts by interval on the page: as JSON for its charts, and tables of any day to download."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable, Mapping, Sequence
from datetime import date
from functools import partial
from pathlib import Path
from typing import Any, TypeVar

import pyarrow as pa
import pyarrow.compute as pc
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import JSONResponse, Response
from starlette.routing import Route

from vidtrack.errors import FormatError
from vidtrack.output.figures import csv_of
from vidtrack.output.intervals.day import Day, Plan, day_folders, read_day
from vidtrack.output.intervals.days import DAY_S, EVERY, date_of, span_of, zone_of
from vidtrack.serve.camera import Camera, Shared

Value = TypeVar("Value")

_LEAST_S = 2.0  # between two looks at the files of a camera


class Counts:
    """Routes to the counts of `cameras`, which are read from their files: a camera that is down has them too."""

    def __init__(self, cameras: Mapping[str, Camera]) -> None:
        self._last: dict[tuple[int, str], Shared[dict[str, Any]]] = {}
        self.show(cameras)

    def show(self, cameras: Mapping[str, Camera]) -> None:
        """Answer for these cameras from now on."""
        self._cameras = list(cameras.values())
        self._last.clear()

    def routes(self) -> list[Route]:
        """The routes."""
        return [
            Route("/counts/{number:int}.json", self.last_day),
            Route("/counts/{number:int}/{day}.csv", self.table),
            Route("/counts/{number:int}/{day}.json", self.one_day),
        ]

    async def last_day(self, request: Request) -> Response:
        """The intervals of the last 24 hours, the counts of today and of the last hour, and the days that there are."""
        key = number, every = request.path_params["number"], _every(request)
        folder = self._folder(number)
        if folder is None:
            return JSONResponse({"days": [], "intervals": []})
        if key not in self._last:
            self._last[key] = Shared(partial(_last_day, folder, EVERY[every]), _LEAST_S)
        try:
            return JSONResponse(await self._last[key].get())
        except FormatError as error:
            raise HTTPException(500, f"{error}\n") from None

    async def one_day(self, request: Request) -> Response:
        """The intervals of one local day."""
        folder, every = self._day(request), _every(request)
        return JSONResponse(await _read(_one_day, folder, EVERY[every]))

    async def table(self, request: Request) -> Response:
        """The table of one local day, as CSV with the columns of `vidtrack measure`."""
        folder, every = self._day(request), _every(request)
        content = await _read(_csv, folder, EVERY[every])
        named = {"Content-Disposition": f'attachment; filename="{folder.name}-{every}.csv"'}
        return Response(content, media_type="text/csv; charset=utf-8", headers=named)

    def _day(self, request: Request) -> Path:
        """The folder of the day that is asked for. Raises HTTPException."""
        folder, day = self._folder(request.path_params["number"]), request.path_params["day"]
        try:
            date.fromisoformat(day)
        except ValueError:
            raise HTTPException(404, "write the day as 2026-11-22\n") from None
        if folder is None or not (folder / day).is_dir():
            raise HTTPException(404, "nothing was counted on that day\n")
        return folder / day

    def _folder(self, number: int) -> Path | None:
        if number >= len(self._cameras):
            raise HTTPException(404, "no such camera\n")
        return self._cameras[number].counts()


def _every(request: Request) -> str:
    every = request.query_params.get("every", "15min")
    if every not in EVERY:
        raise HTTPException(400, f"every is one of {', '.join(EVERY)}\n")
    return every


async def _read(make: Callable[[Path, float], Value], folder: Path, every_s: float) -> Value:
    """What a function makes of a folder, in a thread of its own. Raises HTTPException for a damaged one."""
    try:
        return await asyncio.to_thread(make, folder, every_s)
    except FormatError as error:
        raise HTTPException(500, f"{error}\n") from None


def _last_day(folder: Path, every_s: float) -> dict[str, Any]:
    folders, now_s = day_folders(folder), time.time()
    found: dict[str, Any] = {"since_s": now_s - DAY_S, "until_s": now_s, "every_s": every_s, "intervals": []}
    if folders:
        plan, days = Plan.read(folder), [read_day(day) for day in folders[-2:]]
        zone = zone_of(plan.zone)
        midnight_s = span_of(date_of(now_s, zone), zone)[0]
        rows = [row for day in days for row in _rows(day.intervals(every_s, plan))]
        found["intervals"] = [row for row in rows if row["end_s"] > now_s - DAY_S]
        found |= {"today": _counted(days, plan, midnight_s), "hour": _counted(days, plan, now_s - 3600)}
    return found | {"days": [day.name for day in folders]}


def _one_day(folder: Path, every_s: float) -> dict[str, Any]:
    plan = Plan.read(folder.parent)
    since_s, until_s = span_of(date.fromisoformat(folder.name), zone_of(plan.zone))
    rows = _rows(read_day(folder).intervals(every_s, plan))
    return {"since_s": since_s, "until_s": until_s, "every_s": every_s, "intervals": rows}


def _counted(days: Sequence[Day], plan: Plan, since_s: float) -> dict[str, dict[str, int]]:
    """Crossings since a Unix time [s], by gate and direction."""
    counts = {gate: dict.fromkeys(ways, 0) for gate, ways in plan.gates.items()}
    for day in days:
        late = pc.greater_equal(day.crossings["utc"].cast(pa.int64()), round(1000 * since_s))
        for row in day.crossings.filter(late).select(["gate", "direction"]).to_pylist():
            if row["direction"] in counts.get(row["gate"], ()):
                counts[row["gate"]][row["direction"]] += 1
    return counts


def _rows(table: pa.Table) -> list[dict[str, Any]]:
    """The intervals as JSON objects; times are Unix times [s]."""
    when = {name: pc.divide(table[f"{name[:-2]}_utc"].cast(pa.int64()), 1000) for name in ("begin_s", "end_s")}
    kept = ("gate", "direction", "coverage", "count", "flow_per_h", "time_mean_speed_kmh", "v85_kmh")
    return pa.table({**when, **{name: table[name] for name in kept}}).to_pylist()


def _csv(folder: Path, every_s: float) -> bytes:
    return csv_of(read_day(folder).intervals(every_s, Plan.read(folder.parent)))
