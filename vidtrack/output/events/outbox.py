"""The events that wait for one receiver, in a queue on the disk that a kill does not empty.

    outbox/mqtt/00000007.jsonl   the events, one line of JSON each, appended; a new file after an eighth of the limit
    outbox/mqtt/sent.json        which of them are sent, and how many were dropped

Files whose events are all sent are deleted. Beyond the limit the oldest file is deleted, and its events that were not
sent are counted as dropped.
"""

from __future__ import annotations

import json
import os
from collections import deque
from collections.abc import Iterable
from itertools import islice
from pathlib import Path
from threading import Condition

from vidtrack.errors import Error, FormatError
from vidtrack.output.folder import append, usable, writing
from vidtrack.output.linefile import drop_partial_line, replace_text

_VERSION = 1
_SENT = "sent.json"
_SHARE = 1 / 8
_MOST = 10_000  # events that wait for room on the disk


class Outbox:
    """A queue of lines in `folder`, of at most `limit` bytes, which the next run continues. Safe in any thread.

    dropped  number of events that were never sent
    failing  why events cannot be written to the disk now; None: they can

    The constructor raises OutputError if the folder cannot be used, FormatError if a later version has written it.
    """

    def __init__(self, folder: Path, limit: float) -> None:
        self.failing: str | None = None
        self._folder = usable(folder)
        self._limit = limit
        self._unwritten: deque[str] = deque()
        self._changed = Condition()
        self._first, self._offset, self.dropped = self._resume()
        self._taken: tuple[int, int] | None = None  # where the lines were that `oldest` gave
        numbers = self._numbers()
        for number in numbers:
            drop_partial_line(self._file(number))
            if number < self._first:
                self._file(number).unlink()
        if self._first not in numbers:
            self._first, self._offset = next((n for n in numbers if n > self._first), self._first), 0
        self._last = max(numbers, default=self._first)
        self._waiting = sum(self._lines(number) for number in numbers if number >= self._first)

    @property
    def waiting(self) -> int:
        """Number of events that are not sent yet."""
        return self._waiting + len(self._unwritten)

    def add(self, lines: Iterable[str]) -> None:
        """Queue lines, and write all that are not written. A full disk raises nothing: a later call writes them."""
        with self._changed:
            for line in lines:
                self.dropped += len(self._unwritten) == _MOST
                if len(self._unwritten) == _MOST:
                    self._unwritten.popleft()
                self._unwritten.append(line)
            try:
                while self._unwritten:
                    self._write()
            except (Error, OSError) as error:
                self.failing = str(error)
            else:
                self.failing = None
            self._changed.notify_all()

    def wait(self, timeout_s: float) -> None:
        """Wait until there is an event on the disk, or `wake` is called, at most so long."""
        with self._changed:
            if not self._waiting:
                self._changed.wait(timeout_s)

    def wake(self) -> None:
        """End a wait."""
        with self._changed:
            self._changed.notify_all()

    def oldest(self, count: int) -> list[str]:
        """The oldest lines on the disk, at most `count`; none if there are none. Raises OSError."""
        with self._changed:
            while self._waiting:
                with open(self._file(self._first), "rb") as file:
                    file.seek(self._offset)
                    lines = [line.decode("utf-8") for line in islice(file, count)]
                if lines:
                    self._taken = self._first, self._offset
                    return lines
                self._forget_first()
            return []

    def sent(self, lines: Iterable[str]) -> None:
        """Note that these, the oldest, need not be sent again. Raises StoppedEarly."""
        with self._changed:
            if self._taken != (self._first, self._offset):
                return  # their file was deleted meanwhile, and they are counted as dropped
            for line in lines:
                self._offset += len(line.encode())
                self._waiting -= 1
            self._note()

    def _write(self) -> None:
        """Append what is not written, up to the end of a file."""
        most = self._limit * _SHARE
        path = self._file(self._last)
        size = path.stat().st_size if path.exists() else 0
        if size > most:
            self._last += 1
            path, size = self._file(self._last), 0
        count = 0
        for line in self._unwritten:
            if size > most:
                break
            size += len(line.encode())
            count += 1
        block = "".join(islice(self._unwritten, count)).encode()
        with writing(path), open(path, "ab", buffering=0) as file:
            append(file, block)
            os.fdatasync(file.fileno())
        for _ in range(count):
            self._unwritten.popleft()
        self._waiting += count
        self._make_room()

    def _make_room(self) -> None:
        """Delete the oldest files beyond the limit."""
        sizes = {number: self._file(number).stat().st_size for number in self._numbers()}
        while len(sizes) > 1 and sum(sizes.values()) > self._limit:
            lost = self._lines(self._first)
            self._waiting -= lost
            self.dropped += lost
            del sizes[self._first]
            self._forget_first()

    def _forget_first(self) -> None:
        """Go on with the next file, and delete the first one."""
        done = self._file(self._first)
        self._first, self._offset = self._first + 1, 0
        self._last = max(self._last, self._first)
        self._note()
        done.unlink(missing_ok=True)

    def _lines(self, number: int) -> int:
        """Number of lines of a file that are not sent."""
        path = self._file(number)
        if not path.exists():
            return 0
        with open(path, "rb") as file:
            file.seek(self._offset if number == self._first else 0)
            return sum(1 for _ in file)

    def _numbers(self) -> list[int]:
        return sorted(int(path.stem) for path in self._folder.glob("*.jsonl") if path.stem.isdecimal())

    def _file(self, number: int) -> Path:
        return self._folder / f"{number:08d}.jsonl"

    def _note(self) -> None:
        now = {"version": _VERSION, "file": self._first, "offset": self._offset, "dropped": self.dropped}
        replace_text(self._folder / _SENT, json.dumps(now) + "\n")

    def _resume(self) -> tuple[int, int, int]:
        """File and offset of the first event that is not sent, and how many were dropped.

        Without a readable note all that is there is sent, once more.
        """
        path = self._folder / _SENT
        try:
            noted = json.loads(path.read_text(encoding="utf-8"))
            found = int(noted["file"]), int(noted["offset"]), int(noted["dropped"])
        except (OSError, ValueError, KeyError, TypeError):
            return min(self._numbers(), default=1), 0, 0
        if noted.get("version") != _VERSION:
            raise FormatError(f"{path} is of version {noted.get('version')}, this is {_VERSION}; use a later vidtrack")
        return found
