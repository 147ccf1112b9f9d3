"""Serves the live page in a thread."""

from __future__ import annotations

from collections.abc import Mapping
from threading import Thread
from types import TracebackType

import uvicorn

from vidtrack.serve.access import protected
from vidtrack.serve.app import Answers
from vidtrack.serve.camera import Camera
from vidtrack.serve.connection import Connection
from vidtrack.serve.listener import listen, url_of

_END_S = 0.5


class Page:
    """Context manager that serves the page at "[HOST:]PORT".

    place  without a host, on loopback; port 0 is any free port
    token  required of clients; without one only this machine has access

    url    of the page

    The tracker never waits for the page: cameras are read on request, and a slow client delays only its own
    connection. Raises ConfigError if the port cannot be used.
    """

    def __init__(self, place: str, token: str | None = None) -> None:
        self._listener = listen(place, token)
        self._token = token
        self._server: uvicorn.Server | None = None
        self.url = url_of(self._listener)

    def show(self, cameras: Mapping[str, Camera]) -> None:
        """Start to respond; until then clients wait."""
        self._server = uvicorn.Server(
            uvicorn.Config(
                protected(Answers(cameras).app(), self._token),
                loop="asyncio",
                http=Connection,
                ws="none",
                lifespan="off",
                log_config=None,
                log_level="critical",  # clients' errors are not logged; the application logs its own
                access_log=False,
                server_header=False,
                proxy_headers=False,
                timeout_graceful_shutdown=0,
            )
        )
        self._thread = Thread(target=self._server.run, args=([self._listener],), name="page", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Close all connections and the port."""
        if self._server is not None:
            self._server.force_exit = self._server.should_exit = True
            self._thread.join(_END_S)
        self._listener.close()

    def __enter__(self) -> Page:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()
