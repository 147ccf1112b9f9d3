"""Tells systemd that the service is ready, works, and ends: datagrams to the socket that it names (sd_notify(3))."""

from __future__ import annotations

import os
import socket
from collections.abc import Callable
from contextlib import suppress
from threading import Event, Thread
from types import TracebackType

_UNWATCHED_S = 30.0  # between two reports without a watchdog
_SHARE = 1 / 3  # of the watchdog's time: between two reports


def notify(state: str) -> None:
    """Send lines of NAME=VALUE to systemd; without it nothing happens."""
    place = os.environ.get("NOTIFY_SOCKET")
    if not place or not hasattr(socket, "AF_UNIX"):
        return
    address = "\0" + place[1:] if place.startswith("@") else place
    with suppress(OSError), socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as sender:
        sender.sendto(state.encode(), address)


class Reports:
    """Context manager: a thread that reports to systemd while the block runs.

    look  returns whether a restart would mend nothing, and the state in words. Without the former the watchdog is not
          fed, and systemd restarts the service after WatchdogSec
    """

    def __init__(self, look: Callable[[], tuple[bool, str]]) -> None:
        self._look = look
        self._ending = Event()
        watchdog_s = int(os.environ.get("WATCHDOG_USEC", "0")) / 1e6
        self._every_s = watchdog_s * _SHARE or _UNWATCHED_S

    def __enter__(self) -> Reports:
        if os.environ.get("NOTIFY_SOCKET"):
            notify("READY=1")
            Thread(target=self._run, name="systemd", daemon=True).start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._ending.set()
        notify("STOPPING=1")

    def _run(self) -> None:
        while True:
            works, words = self._look()
            notify(f"STATUS={words}" + ("\nWATCHDOG=1" if works else ""))
            if self._ending.wait(self._every_s):
                return
