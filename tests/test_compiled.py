"""What the compiler owes a user: it can be stopped, and what it keeps is never out of date."""

import errno
import os
import signal
import sys
from contextlib import contextmanager
from hashlib import sha1
from pathlib import Path
from subprocess import PIPE, Popen
from threading import Thread

import pytest
from numba import config, njit
from numba.core.errors import TypingError
from numba.core.event import Listener, install_listener

from vidtrack.cli.signals import Terminated, terminate
from vidtrack.compiled import first_run, forget_stale, kernel


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


COMPILE = """
import sys
sys.path.insert(0, sys.argv[1])
import summed
print("ready", flush=True)
sys.stdin.readline()
summed.add(1, 2)
print(sum(summed.add.stats.cache_misses.values()))
"""


@pytest.mark.skipif(sys.platform == "win32", reason="needs file locks")
def test_of_several_processes_one_compiles_and_the_others_wait(tmp_path):
    (tmp_path / "summed.py").write_text(
        "from vidtrack.compiled import kernel\n@kernel\ndef add(x, y):\n    return x + y\n"
    )
    command = [sys.executable, "-c", COMPILE, str(tmp_path)]
    own = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path / "kernels")}
    several = [Popen(command, stdin=PIPE, stdout=PIPE, text=True, env=own) for _ in range(3)]
    for process in several:
        assert process.stdout.readline() == "ready\n"
    for process in several:
        process.stdin.write("go\n")
        process.stdin.flush()
    assert sorted(int(process.communicate()[0]) for process in several) == [0, 0, 1]
    assert [path.suffix for path in sorted((tmp_path / "kernels").rglob("*.nb?"))] == [".nbc", ".nbi"]


@pytest.mark.skipif(sys.platform == "win32", reason="needs file locks")
def test_a_process_that_hangs_in_the_compiler_is_not_waited_for_without_end(add, tmp_path, monkeypatch):
    import fcntl

    monkeypatch.setattr("vidtrack.compiled._TURN_S", 0.05)
    lock = add._cache._lock
    with open(lock, "w") as other:
        fcntl.flock(other, fcntl.LOCK_EX)
        assert add(1.5, 2.0) == 3.5
    assert list(tmp_path.rglob("*.nbi"))


@pytest.mark.skipif(sys.platform == "win32", reason="needs file locks")
def test_a_kernel_that_does_not_compile_is_not_waited_for(tmp_path, monkeypatch):
    import fcntl

    monkeypatch.setattr(config, "CACHE_DIR", str(tmp_path))

    @kernel
    def lengths(x):
        return len(x)

    with pytest.raises(TypingError):
        lengths(1)
    with open(lengths._cache._lock) as other:
        fcntl.flock(other, fcntl.LOCK_EX | fcntl.LOCK_NB)
    assert lengths((1, 2)) == 2


@pytest.mark.parametrize("elsewhere", [False, True])
def test_kernels_of_others_do_not_make_a_first_run_a_later_one(tmp_path, monkeypatch, elsewhere):
    """Of another Python in the package, and of other packages in NUMBA_CACHE_DIR."""
    package = tmp_path / "vidtrack"
    package.mkdir()
    (package / "scan.py").touch()
    kept = tmp_path / "kernels" if elsewhere else package
    own = kept / f"vidtrack_{sha1(str(package).encode()).hexdigest()}" if elsewhere else package / "__pycache__"
    other = kept / "other_0123" if elsewhere else own
    for folder in {own, other}:
        folder.mkdir(parents=True)
    this = f"py{sys.version_info.major}{sys.version_info.minor}"
    (other / f"scan.find-1.{this if elsewhere else 'py27'}.nbi").touch()
    monkeypatch.setattr("vidtrack.compiled.PACKAGE", package)
    monkeypatch.setattr("vidtrack.compiled.KERNELS", kept)
    monkeypatch.setattr("vidtrack.compiled.CACHE", True)
    assert first_run()
    (own / f"scan.find-1.{this}.nbi").touch()
    assert not first_run()
