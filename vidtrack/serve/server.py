"""Serves an application on a listening socket, in a thread."""

from __future__ import annotations

import asyncio
import socket
from threading import Thread

import uvicorn
from starlette.types import ASGIApp
from uvicorn.protocols.http.h11_impl import H11Protocol

_MOST = 100  # connections at a time; leaves file handles for reopening cameras
_ASK_S = 5.0  # time in which a client must send a request
_END_S = 0.5


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
                http=_Connection,
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


class _Connection(H11Protocol):
    """A connection, refused beyond _MOST and closed without a request within _ASK_S."""

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        super().connection_made(transport)
        if len(self.connections) > _MOST:
            transport.abort()
            return
        self.timeout_keep_alive_task = self.loop.call_later(_ASK_S, self.timeout_keep_alive_handler)
