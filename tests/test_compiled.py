"""What the compiler owes a user: it can be stopped, and what it keeps is never out of date."""

import errno
import os
import signal
import sys
from contextlib import contextmanager
from pathlib import Path
from threading import Thread

import pytest
from numba import config, njit
from numba.core.event import Listener, install_listener

from vidtrack.cli.signals import Terminated, terminate
from vidtrack.compiled import forget_stale, kernel


def kernels():
    """Two kernels that are not compiled yet, the one inside the other."""

    @njit
    def inner(x):
        return x + 1

    @njit
    def outer(x):
        return inner(x) * 2

    return inner, outer


class Sender(Listener):
    """Sends a signal from inside the compiler, as soon as it is at work."""

    def __init__(self, number):
        self._number = number

    def on_start(self, event):
        signal.raise_signal(self._number)

    def on_end(self, event):
        pass


@contextmanager
def handled_by(handler, number):
    before = signal.signal(number, handler)
    yield
    assert signal.signal(number, before) is handler


@pytest.mark.parametrize(
    ("number", "handler", "error"),
    [
        (signal.SIGINT, signal.default_int_handler, KeyboardInterrupt),
        (signal.SIGTERM, terminate, Terminated),
    ],
)
def test_a_signal_comes_when_the_kernel_is_compiled(number, handler, error):
    inner, outer = kernels()
    with handled_by(handler, number):
        with install_listener("numba:compile", Sender(number)), pytest.raises(error):
            outer(1)
        assert inner.signatures
        assert outer.signatures
    assert outer(1) == 4


def test_a_signal_that_is_ignored_stays_so():
    _, outer = kernels()
    with handled_by(signal.SIG_IGN, signal.SIGTERM), install_listener("numba:compile", Sender(signal.SIGTERM)):
        assert outer(1) == 4


def test_a_handler_that_is_not_pythons_is_left_alone(monkeypatch):
    """As in a program in C that has a Python inside: there is no way to put its handler back."""
    _, outer = kernels()
    taken = []
    monkeypatch.setattr(signal, "getsignal", lambda number: None)
    monkeypatch.setattr(signal, "signal", lambda *given: taken.append(given))
    assert outer(1) == 4
    assert taken == []


def test_another_thread_compiles_without_touching_the_handlers():
    _, outer = kernels()
    found = []
    thread = Thread(target=lambda: found.append(outer(1)))
    thread.start()
    thread.join()
    assert found == [4]


@pytest.mark.parametrize(("age_s", "left"), [(-10, 4), (10, 0)])
def test_one_changed_source_makes_all_kernels_stale(tmp_path, age_s, left):
    for folder, name in (("a", "gate"), ("b", "grid")):
        kept = tmp_path / folder / "__pycache__"
        kept.mkdir(parents=True)
        (tmp_path / folder / f"{name}.py").touch()
        for ending in ("nbi", "1.nbc"):
            (kept / f"{name}.find-12.py311.{ending}").touch()
    for source in tmp_path.rglob("*.py"):
        os.utime(source, times=(0, 0))
    now = (tmp_path / "a" / "__pycache__" / "gate.find-12.py311.nbi").stat().st_mtime
    os.utime(tmp_path / "a" / "gate.py", times=(now + age_s, now + age_s))
    forget_stale(tmp_path)
    assert len(list(tmp_path.rglob("*.nb?"))) == left


def test_kernels_of_a_source_that_is_gone_are_stale(tmp_path):
    (tmp_path / "__pycache__").mkdir()
    kernel = tmp_path / "__pycache__" / "gone.find-1.py311.nbi"
    kernel.touch()
    forget_stale(tmp_path)
    assert not kernel.exists()


def test_two_processes_may_delete_stale_kernels_at_once(tmp_path, monkeypatch):
    (tmp_path / "__pycache__").mkdir()
    (tmp_path / "find.py").touch()
    monkeypatch.setattr(Path, "rglob", lambda *_: [tmp_path / "__pycache__" / "find.find-1.py311.nbi"])
    forget_stale(tmp_path)


@pytest.fixture
def add(tmp_path, monkeypatch):
    """A kernel that is not compiled yet, and whose compiled form will be kept in `tmp_path`."""
    monkeypatch.setattr(config, "CACHE_DIR", str(tmp_path))

    @kernel
    def add(x, y):
        return x + y

    return add


def test_kernels_are_kept(add, tmp_path):
    assert add(1, 2) == 3
    assert len(list(tmp_path.rglob("*.nbi"))) == len(list(tmp_path.rglob("*.nbc"))) == 1


def test_a_full_disk_costs_a_warning_and_no_result(add, tmp_path, monkeypatch, caplog):
    def full(*_):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr("numba.core.caching.IndexDataCacheFile.save", full)
    assert add(1, 2) == 3
    assert add(1.5, 2.0) == 3.5
    assert len(caplog.messages) == 1
    assert "No space left" in caplog.text


@pytest.mark.skipif(sys.platform == "win32", reason="needs file locks")
def test_processes_take_turns_at_keeping(add, tmp_path):
    import fcntl

    add(1, 2)
    (index,) = tmp_path.rglob("*.nbi")
    other = os.open(index.parent, os.O_RDONLY)
    fcntl.flock(other, fcntl.LOCK_EX)
    found = []
    thread = Thread(target=lambda: found.append(add(1.5, 2.0)))
    thread.start()
    thread.join(0.5)
    assert len(list(tmp_path.rglob("*.nbc"))) == 1
    os.close(other)
    thread.join()
    assert found == [3.5]
    assert len(list(tmp_path.rglob("*.nbc"))) == 2
