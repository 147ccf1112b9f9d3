"""Serves an application on a listening socket, in a thread."""

from __future__ import annotations

import socket
from threading import Thread

import uvicorn
from starlette.types import ASGIApp

from vidtrack.serve.connection import Connection

_END_S = 0.2


class Server:
    """A slow client delays only its own connection. Until `start`, clients wait."""

    def __init__(self, listener: socket.socket) -> None:
        self._listener = listener
        self._server: uvicorn.Server | None = None

    def start(self, app: ASGIApp) -> None:
        """Start to respond."""
        self._server = uvicorn.Server(
            uvicorn.Config(
                app,
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
