"""The counts by interval on the page: the last day as JSON for its chart, and tables of any day to download."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Mapping
from datetime import date
from functools import partial
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.compute as pc
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import JSONResponse, Response
from starlette.routing import Route

from vidtrack.errors import FormatError
from vidtrack.output.figures import csv_of
from vidtrack.output.intervals.day import Plan, day_folders, read_day
from vidtrack.output.intervals.days import DAY_S, EVERY
from vidtrack.serve.camera import Camera, Shared

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
        ]

    async def last_day(self, request: Request) -> Response:
        """The intervals of the last 24 hours, and the days that can be downloaded."""
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

    async def table(self, request: Request) -> Response:
        """The table of one local day, as CSV with the columns of `vidtrack measure`."""
        number, every, day = request.path_params["number"], _every(request), request.path_params["day"]
        folder = self._folder(number)
        try:
            date.fromisoformat(day)
        except ValueError:
            raise HTTPException(404, "write the day as 2026-11-22\n") from None
        if folder is None or not (folder / day).is_dir():
            raise HTTPException(404, "nothing was counted on that day\n")
        content = await asyncio.to_thread(_csv, folder / day, EVERY[every])
        named = {"Content-Disposition": f'attachment; filename="{day}-{every}.csv"'}
        return Response(content, media_type="text/csv; charset=utf-8", headers=named)

    def _folder(self, number: int) -> Path | None:
        if number >= len(self._cameras):
            raise HTTPException(404, "no such camera\n")
        return self._cameras[number].counts()


def _every(request: Request) -> str:
    every = request.query_params.get("every", "15min")
    if every not in EVERY:
        raise HTTPException(400, f"every is one of {', '.join(EVERY)}\n")
    return every


def _last_day(folder: Path, every_s: float) -> dict[str, Any]:
    days = day_folders(folder)
    rows: list[dict[str, Any]] = []
    since_s = time.time() - DAY_S
    if days:
        plan = Plan.read(folder)
        tables = [read_day(day).intervals(every_s, plan) for day in days[-2:]]
        rows = [row for table in tables for row in _rows(table) if row["end_s"] > since_s]
    return {"since_s": since_s, "every_s": every_s, "days": [day.name for day in days], "intervals": rows}


def _rows(table: pa.Table) -> list[dict[str, Any]]:
    """The intervals as JSON objects; times are Unix times [s]."""
    when = {name: pc.divide(table[f"{name[:-2]}_utc"].cast(pa.int64()), 1000) for name in ("begin_s", "end_s")}
    kept = ("gate", "direction", "coverage", "count", "flow_per_h", "time_mean_speed_kmh", "v85_kmh")
    return pa.table({**when, **{name: table[name] for name in kept}}).to_pylist()


def _csv(folder: Path, every_s: float) -> bytes:
    try:
        table = read_day(folder).intervals(every_s, Plan.read(folder.parent))
    except FormatError as error:
        raise HTTPException(500, f"{error}\n") from None
    return csv_of(table)
