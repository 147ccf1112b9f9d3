"""The HTTP routes of the page."""

from __future__ import annotations

import asyncio
import json
import logging
from collections.abc import AsyncIterator, Mapping
from pathlib import Path

from starlette.applications import Starlette
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import FileResponse, JSONResponse, PlainTextResponse, Response, StreamingResponse
from starlette.routing import Mount, Route
from starlette.staticfiles import StaticFiles

from vidtrack.serve.camera import Camera, Shared, Status
from vidtrack.serve.counts import Counts
from vidtrack.serve.metrics import CONTENT_TYPE, metrics
from vidtrack.serve.pictures import Pictures

log = logging.getLogger(__name__)

_STATIC = Path(__file__).with_name("static")
_STATUS_S = 0.02  # least time between two status requests to a camera
_PICTURE_S = 0.2  # least time between two pictures of a camera


class Answers:
    """The page over `cameras` by name, and the same for other programs.

    Status and pictures are computed on request, and shared by simultaneous requests.
    """

    def __init__(self, cameras: Mapping[str, Camera]) -> None:
        self._counts, self._events = Counts(cameras), Pictures(cameras)
        self.show(cameras)

    def show(self, cameras: Mapping[str, Camera]) -> None:
        """Show these cameras from now on."""
        self._counts.show(cameras)
        self._events.show(cameras)
        self._pictures = [Shared(camera.picture, _PICTURE_S) for camera in cameras.values()]
        self._cameras = [(name, camera, Shared(camera.status, _STATUS_S)) for name, camera in cameras.items()]

    def app(self) -> Starlette:
        """The ASGI application."""
        return Starlette(
            routes=[
                Route("/", self.page),
                Route("/status", self.status),
                Route("/picture/{number:int}.jpg", self.picture),
                Route("/tracks", self.tracks),
                Route("/metrics", self.metrics),
                Route("/healthz", self.healthz),
                *self._counts.routes(),
                *self._events.routes(),
                Mount("/static", StaticFiles(directory=_STATIC)),
            ],
            exception_handlers={Exception: _failed},
        )

    async def page(self, request: Request) -> Response:
        """The HTML page, whose script requests the other routes."""
        return FileResponse(_STATIC / "page.html")

    async def status(self, request: Request) -> Response:
        """Name, health and status of each camera."""
        return JSONResponse(
            [{"name": name, "up": trouble is None, **status} for name, status, trouble in await self._looks()]
        )

    async def picture(self, request: Request) -> Response:
        """The newest annotated picture of a camera, by its number on the page."""
        number = request.path_params["number"]
        if number >= len(self._pictures):
            raise HTTPException(404, "no such camera\n")
        jpeg = await self._pictures[number].get()
        if jpeg is None:
            raise HTTPException(503, "no picture yet\n")
        return Response(jpeg, media_type="image/jpeg")

    async def tracks(self, request: Request) -> Response:
        """The tracks of each camera's frames, one JSON object per line, until the client disconnects."""
        return StreamingResponse(self._lines(), media_type="application/x-ndjson")

    async def metrics(self, request: Request) -> Response:
        """The metrics for Prometheus."""
        looks = [(name, status, trouble is None) for name, status, trouble in await self._looks()]
        return Response(metrics(looks), media_type=CONTENT_TYPE)

    async def healthz(self, request: Request) -> Response:
        """200 if all cameras deliver, else 503 with a line for each that does not."""
        down = [f"{name}: {trouble}" for name, _, trouble in await self._looks() if trouble is not None]
        return PlainTextResponse("\n".join(down or ["ok"]) + "\n", 503 if down else 200)

    async def _looks(self) -> list[tuple[str, Status, str | None]]:
        """Name, status and trouble of each camera."""
        cameras = self._cameras
        statuses = await asyncio.gather(*(shared.get() for _, _, shared in cameras))
        return [
            (name, status, camera.trouble(status)) for (name, camera, _), status in zip(cameras, statuses, strict=True)
        ]

    async def _lines(self) -> AsyncIterator[str]:
        """Always the newest frame: a slow client misses frames, and no queue grows."""
        sent: dict[str, int] = {}
        while True:
            for name, status, _ in await self._looks():
                frame = status.get("frame", -1)
                if frame > sent.get(name, -1):
                    sent[name] = frame
                    line = {"camera": name, **{key: status[key] for key in ("frame", "time_s", "tracks")}}
                    yield json.dumps(line, allow_nan=False) + "\n"
            await asyncio.sleep(_STATUS_S)


async def _failed(request: Request, error: Exception) -> Response:
    log.error("the page failed at %s", request.url.path, exc_info=error)
    return PlainTextResponse("this is a bug of vidtrack; its log says more\n", 500)
