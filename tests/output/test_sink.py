"""Sinks end together, whatever becomes of one of them."""

from __future__ import annotations

import pytest

from vidtrack.errors import StoppedEarly
from vidtrack.output.sink import Step
from vidtrack.output.threaded import close_together


class Recorded:
    """A sink that notes its end in `closed`, and may fail in it."""

    def __init__(self, name: str, closed: set[str], fails: bool = False) -> None:
        self._name, self._closed, self._fails = name, closed, fails

    def step(self, step: Step) -> None:
        """Nothing."""

    def close(self) -> None:
        """Note it, and fail if asked to."""
        self._closed.add(self._name)
        if self._fails:
            raise StoppedEarly(f"no room for {self._name}")


@pytest.mark.parametrize("failing", ["table", "picture"])
def test_all_are_closed_when_one_fails(failing):
    closed: set[str] = set()
    sinks = [Recorded(name, closed, name == failing) for name in ("table", "boxes", "picture")]
    with pytest.raises(StoppedEarly, match=failing):
        close_together(*sinks)
    assert closed == {"table", "boxes", "picture"}


def test_one_alone_is_closed():
    closed: set[str] = set()
    close_together(Recorded("table", closed))
    assert closed == {"table"}
