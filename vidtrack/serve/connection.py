"""One client's connection: it has to ask in time, and gives way to others when there are too many."""

from __future__ import annotations

import asyncio
from collections import Counter
from collections.abc import Iterable

from uvicorn.protocols.http.h11_impl import H11Protocol

MOST = 100
"""Connections at a time; leaves file handles for reopening cameras."""
MOST_EACH = 50
"""Connections of one address at a time."""
ASK_S = 5.0
"""s; time in which a client must have sent a whole request, however many bytes of it come meanwhile."""


class Connection(H11Protocol):
    """A connection that is closed without a whole request in ASK_S.

    Beyond MOST, or MOST_EACH from one address, the oldest one that waits for a request is closed, and where all are
    being answered the oldest of these, but never the newest one: a client that asks at once is answered, whatever
    others hold open.
    """

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        super().connection_made(transport)
        self.address = "" if self.client is None else self.client[0]
        self.since_s = self.loop.time()
        self._deadline = self.loop.call_later(ASK_S, transport.abort)
        self.loop.call_later(0, self._make_room)  # when requests that have come together with connections are read

    def connection_lost(self, exc: Exception | None) -> None:
        self._deadline.cancel()
        super().connection_lost(exc)

    def data_received(self, data: bytes) -> None:
        super().data_received(data)
        if self.is_answered and not self.cycle.more_body:
            self._deadline.cancel()

    def on_response_complete(self) -> None:
        self._deadline.cancel()
        self._deadline = self.loop.call_later(self.timeout_keep_alive + ASK_S, self.transport.abort)
        super().on_response_complete()

    @property
    def is_answered(self) -> bool:
        """Whether a response is being sent."""
        return self.cycle is not None and not self.cycle.response_complete

    def _make_room(self) -> None:
        """Close a connection if there are too many."""
        every = [one for one in self.connections if isinstance(one, Connection) and not one.is_closing]
        own = [other for other in every if other.address == self.address]
        if len(own) > MOST_EACH:
            _first_to_go(own).transport.abort()
        elif len(every) > MOST:
            _first_to_go(every).transport.abort()

    @property
    def is_closing(self) -> bool:
        """Whether the connection is being closed."""
        return self.transport.is_closing()


def _first_to_go(connections: Iterable[Connection]) -> Connection:
    """The oldest one without a response, else the oldest, of the address that has most; never the newest."""
    *older, _ = sorted(connections, key=lambda one: one.since_s)
    held = Counter(connection.address for connection in older)
    return min(older, key=lambda one: (one.is_answered, -held[one.address], one.since_s))
