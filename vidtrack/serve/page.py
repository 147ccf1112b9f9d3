"""The live page."""

from __future__ import annotations

import socket
from collections.abc import Mapping
from types import TracebackType

from vidtrack.serve.access import protected
from vidtrack.serve.app import Answers
from vidtrack.serve.camera import Camera
from vidtrack.serve.listener import listen, url_of
from vidtrack.serve.server import Server

_ANSWER_S = 5.0


class Page:
    """Context manager that serves the page at "[HOST:]PORT".

    place  without a host, on loopback; port 0 is any free port
    token  required of clients; without one only this machine has access

    url    of the page

    The tracker never waits for the page: cameras are read on request. Raises ConfigError if the port cannot be used.
    """

    def __init__(self, place: str, token: str | None = None) -> None:
        self._listener = listener = listen(place, token)
        self._server = Server(listener)
        self._token = token
        self._answers: Answers | None = None
        self.url = url_of(listener)

    def show(self, cameras: Mapping[str, Camera]) -> None:
        """Start to respond; until then clients wait. Called again, show these cameras instead."""
        if self._answers is None:
            self._answers = Answers(cameras)
            self._server.start(protected(self._answers.app(), self._token))
        else:
            self._answers.show(cameras)

    def answers(self) -> bool:
        """Whether the page answers a request within seconds."""
        host, port = self._listener.getsockname()[:2]
        host = {"0.0.0.0": "127.0.0.1", "::": "::1"}.get(host, host)
        try:
            with socket.create_connection((host, port), _ANSWER_S) as client:
                client.sendall(b"GET /healthz HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n")
                return client.recv(8) == b"HTTP/1.1"
        except OSError:
            return False

    def close(self) -> None:
        """Close all connections and the port."""
        self._server.close()

    def __enter__(self) -> Page:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()
