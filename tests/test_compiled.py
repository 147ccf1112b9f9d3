"""What the compiler owes a user: it can be stopped, and what it keeps is never out of date."""

import os
import signal
from contextlib import contextmanager
from threading import Thread

import pytest
from numba import njit
from numba.core.event import Listener, install_listener

from vidtrack.cli.signals import Terminated, terminate
from vidtrack.compiled import forget_stale


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
