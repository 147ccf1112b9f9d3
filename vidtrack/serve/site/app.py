"""The HTTP routes of the page on which a site is drawn."""

from __future__ import annotations

import json
import logging
import time
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from threading import Lock
from typing import Any

import numpy as np
from starlette.applications import Starlette
from starlette.concurrency import run_in_threadpool
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import FileResponse, JSONResponse, PlainTextResponse, Response
from starlette.routing import Mount, Route
from starlette.staticfiles import StaticFiles

from vidtrack.errors import Error
from vidtrack.serve.site.draft import Draft
from vidtrack.serve.site.file import ChangedError, SiteFile, Tree
from vidtrack.serve.site.plan import World, is_world, read_world, write_world
from vidtrack.traffic.measures.recount import Recount

log = logging.getLogger(__name__)

_STATIC = Path(__file__).with_name("static")
_COLOURS = Path(__file__).parents[1] / "static" / "colours.css"
_LARGEST = 4_000_000  # bytes of a request
_DRAINED = 16 * _LARGEST  # bytes that are read before a request is refused for its size
_GONE_S = 90.0  # a page that did not ask for so long is gone; browsers let hidden ones ask once a minute
_MOST_EDITORS = 100


@dataclass(frozen=True, slots=True)
class Picture:
    """What the page shows: the name that it is told, and the picture as JPEG or PNG."""

    name: str
    content: bytes
    kind: str


class Desk:
    """A run, the site that is drawn over it, and who draws.

    name     of the run
    file     of the site; new: the site, where there is no file yet
    scene    the camera's picture; None: plain grey
    plan     a plan of the road beside it, and the file that its world file stands beside
    live     file of the camera's newest picture, if the run goes on: it takes the place of `scene`
    """

    def __init__(
        self, name: str, recount: Recount, file: SiteFile, new: Tree, scene: Picture | None,
        plan: tuple[Path, Picture] | None, live: Path | None = None,
    ) -> None:  # fmt: skip
        self._name, self._recount, self.file, self._new = name, recount, file, new
        self._scene, self._plan, self._live = scene, plan, live
        self._draft, self._counting = Draft(recount), Lock()
        self._editors: dict[str, float] = {}

    def app(self) -> Starlette:
        """The ASGI application."""
        return Starlette(
            routes=[
                Route("/", lambda request: FileResponse(_STATIC / "page.html")),
                Route("/drawing", self.drawing),
                Route("/scene", lambda request: _picture(self._newest() or self._scene)),
                Route("/plan", lambda request: _picture(self._plan and self._plan[1])),
                Route("/look", self.look, methods=["POST"]),
                Route("/paths", self.paths, methods=["POST"]),
                Route("/save", self.save, methods=["POST"]),
                Route("/here", self.here, methods=["POST"]),
                Route("/static/colours.css", lambda request: FileResponse(_COLOURS)),
                Mount("/static", StaticFiles(directory=_STATIC)),
            ],
            exception_handlers={Error: _refused, Exception: _failed},
        )

    def drawing(self, request: Request) -> Response:
        """The site as it is in its file, or a new one, and what it is drawn over."""
        tree, digest = self.file.read()
        plan = None
        if self._plan is not None:
            plan = {"name": self._plan[1].name, "world": read_world(self._plan[0])}
        return JSONResponse(
            {
                "run": self._name,
                "file": str(self.file.path),
                "tree": tree or self._new,
                "digest": digest,
                "scene": self._live.name if self._live and self._shown() else self._scene and self._scene.name,
                "shown": self._shown(),
                "plan": plan,
                "until_s": self._recount.until_s,
            }
        )

    async def look(self, request: Request) -> Response:
        """Mistakes, calibration and counts of a drawing: {tree, count}."""
        asked = await _asked(request, tree=dict, count=bool)
        return JSONResponse(await run_in_threadpool(self._look, asked["tree"], asked["count"]))

    async def paths(self, request: Request) -> Response:
        """All paths where a drawing has them: {tree}. uint32 paths, uint32 corners of each, float32 x, y of all."""
        asked = await _asked(request, tree=dict)
        return Response(await run_in_threadpool(self._paths, asked["tree"]), media_type="application/octet-stream")

    async def save(self, request: Request) -> Response:
        """Write a drawing, {tree, digest, world}; 409 where the file is no longer that of the digest."""
        asked = await _asked(request, tree=dict, digest=str, world=(list, type(None)))
        return JSONResponse(await run_in_threadpool(self._save, asked["tree"], asked["digest"], asked["world"]))

    async def here(self, request: Request) -> Response:
        """A page tells that it is open, or closes: {editor, open}.

        The file's digest, how many others are open, and which picture of a run that goes on is the newest.
        """
        asked = await _asked(request, editor=str, open=bool)
        now = time.monotonic()
        self._editors = {one: at for one, at in self._editors.items() if now - at < _GONE_S and one != asked["editor"]}
        others = len(self._editors)
        if asked["open"] and others < _MOST_EDITORS:
            self._editors[asked["editor"]] = now
        found = {"digest": await run_in_threadpool(self.file.digest), "others": others, "shown": self._shown()}
        return JSONResponse(found)

    def _shown(self) -> str | None:
        """What is another for every picture of a run that goes on."""
        with suppress(OSError):
            if self._live is not None:
                return str(self._live.stat().st_mtime_ns)
        return None

    def _newest(self) -> Picture | None:
        with suppress(OSError):
            if self._live is not None:
                return Picture(self._live.name, self._live.read_bytes(), "image/jpeg")
        return None

    def _look(self, tree: Tree, count: bool) -> dict[str, Any]:
        with self._counting:
            return self._draft.look(tree, count)

    def _paths(self, tree: Tree) -> bytes:
        with self._counting:
            lengths, xy = self._draft.paths(tree)
        head = np.concatenate([[len(lengths)], lengths]).astype("<u4")
        return head.tobytes() + xy.astype("<f4").tobytes()

    def _save(self, tree: Tree, digest: str, world: list[Any] | None) -> dict[str, Any]:
        with self._counting:
            faults = self._draft.look(tree, count=True)["faults"]
        if faults:
            raise HTTPException(422, "\n".join(fault["words"] for fault in faults))
        numbers = _world(world) if world is not None and self._plan is not None else None
        new = self.file.save(tree, digest)
        if numbers is not None and self._plan is not None:
            write_world(self._plan[0], numbers)
        return {"digest": new}


def _world(numbers: list[Any]) -> World:
    """The numbers of a world file. Raises HTTPException."""
    try:
        world = tuple(float(number) for number in numbers)
    except (TypeError, ValueError):
        world = ()
    if not is_world(world):
        raise HTTPException(422, "the scale of the plan is no scale")
    return world


def _picture(picture: Picture | None) -> Response:
    if picture is None:
        raise HTTPException(404, "no such picture")
    return Response(picture.content, media_type=picture.kind)


async def _asked(request: Request, **kinds: type | tuple[type, ...]) -> dict[str, Any]:
    """The fields of a request's JSON object. Raises HTTPException where it is none, or too large."""
    content, size = bytearray(), 0
    async for block in request.stream():
        size += len(block)
        if size <= _LARGEST:
            content += block
        elif size > _DRAINED:
            break
    if size > _LARGEST:  # said after the rest was read: a client that still writes reads no answer
        raise HTTPException(413, f"a drawing of more than {_LARGEST} bytes")
    try:
        asked = json.loads(content)
        json.dumps(asked, ensure_ascii=False).encode()  # half a character is no text
    except (ValueError, RecursionError):
        raise HTTPException(400, "no JSON") from None
    if not isinstance(asked, dict) or any(not isinstance(asked.get(name), kind) for name, kind in kinds.items()):
        raise HTTPException(400, f"a JSON object with {', '.join(kinds)} is needed")
    return asked


async def _refused(request: Request, error: Exception) -> Response:
    return PlainTextResponse(str(error), 409 if isinstance(error, ChangedError) else 422)


async def _failed(request: Request, error: Exception) -> Response:
    log.error("the page failed at %s", request.url.path, exc_info=error)
    return PlainTextResponse("this is a bug of vidtrack; its log says more\n", 500)
