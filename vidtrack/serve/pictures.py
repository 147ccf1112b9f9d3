"""The pictures of events on the page: the newest ones, and each at the path that its event has."""

from __future__ import annotations

import asyncio
import re
from collections.abc import Mapping
from pathlib import Path

from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import FileResponse, JSONResponse, Response
from starlette.routing import Route

from vidtrack.output.events.event import PICTURES
from vidtrack.serve.camera import Camera

_DAY, _NAME = re.compile(r"\d{4}-\d\d-\d\d"), re.compile(r"[\dT.-]+-[\da-f]{24}\.jpg")
_NEWEST = 24


class Pictures:
    """Routes to the pictures of events of `cameras` by name."""

    def __init__(self, cameras: Mapping[str, Camera]) -> None:
        self.show(cameras)

    def show(self, cameras: Mapping[str, Camera]) -> None:
        """Answer for these cameras from now on."""
        self._cameras = cameras

    def routes(self) -> list[Route]:
        """The routes."""
        return [
            Route("/camera/{camera}/pictures.json", self.newest),
            Route("/camera/{camera}/pictures/{day}/{name}", self.picture),
        ]

    async def newest(self, request: Request) -> Response:
        """Paths of the newest pictures, the newest first."""
        folder = self._folder(request)
        return JSONResponse([] if folder is None else await asyncio.to_thread(_newest, folder))

    async def picture(self, request: Request) -> Response:
        """A picture."""
        folder, day, name = self._folder(request), request.path_params["day"], request.path_params["name"]
        known = folder is not None and _DAY.fullmatch(day) and _NAME.fullmatch(name)
        if folder is None or not known or not (folder / day / name).is_file():
            raise HTTPException(404, "there is no such picture, or none any more\n")
        return FileResponse(folder / day / name, media_type="image/jpeg")

    def _folder(self, request: Request) -> Path | None:
        camera = self._cameras.get(request.path_params["camera"])
        if camera is None:
            raise HTTPException(404, "no such camera\n")
        counts = camera.counts()
        return None if counts is None else counts.parent / PICTURES


def _newest(folder: Path) -> list[str]:
    found: list[str] = []
    for day in sorted(folder.glob("*-*-*"), reverse=True):
        names = sorted((path.name for path in day.glob("*.jpg") if _NAME.fullmatch(path.name)), reverse=True)
        found += [f"{PICTURES}/{day.name}/{name}" for name in names[: _NEWEST - len(found)]]
        if len(found) == _NEWEST:
            break
    return found
