"""Compiled kernels: the decorators, the cache on the disk, and the handling of signals during compilation."""

from __future__ import annotations

import gc
import logging
import os
import signal
import sys
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from pathlib import Path
from threading import current_thread, get_ident, main_thread
from time import monotonic, sleep
from types import FrameType
from typing import Any

from numba import njit
from numba.core.caching import FunctionCache, UserProvidedCacheLocator
from numba.core.compiler_lock import global_compiler_lock
from numba.core.event import Event, Listener, register
from numba.misc.appdirs import AppDirs

if sys.platform != "win32":
    import fcntl

log = logging.getLogger(__name__)

PACKAGE = Path(__file__).parent
_RARELY = 100_000, 50, 1000
"""While kernels are compiled, Python looks for garbage after so many new objects (usually 700), among older ones every
50th time, and among the oldest every 1000th time of that (usually every 10th)."""
_TURN_S, _LOOK_S = 60.0, 0.02  # a process that takes longer for a kernel is taken to hang


def _writable(folder: Path) -> bool:
    """Whether files can be created in a folder, or in its nearest existing parent."""
    while not folder.exists():
        folder = folder.parent
    return os.access(folder, os.W_OK)


IN_TREE = _writable(PACKAGE / "__pycache__")
KERNELS = Path(os.environ.get("NUMBA_CACHE_DIR") or (PACKAGE if IN_TREE else AppDirs("numba", False).user_cache_dir))
"""The folder below which kernels are kept: NUMBA_CACHE_DIR, else the package, else one of the user"""
CACHE = _writable(KERNELS)
"""Whether kernels can be kept. numba refuses to compile a cached function if no cache folder is writable.

Without a cache, as in a read-only container, each run compiles anew.
"""


def first_run() -> bool:
    """Whether no kernel of this package is kept yet for this version of Python."""
    ours = f"*.py{sys.version_info.major}{sys.version_info.minor}*.nbi"
    if KERNELS == PACKAGE:
        return CACHE and not any(PACKAGE.rglob(ours))
    rooms = {str(source.parent) for source in PACKAGE.rglob("*.py")}
    kept = (KERNELS / UserProvidedCacheLocator.get_suitable_cache_subpath(f"{room}/_.py") for room in rooms)
    return CACHE and not any(any(folder.glob(ours)) for folder in kept)


def kept(kernel: Any) -> bool:
    """Whether compiled code of a kernel is kept."""
    cache = kernel._cache
    return Path(cache.cache_path, f"{cache._impl.filename_base}.nbi").exists()


def forget_stale(package: Path) -> None:
    """Delete all kernels cached below a folder if any source file is newer than one of its kernels.

    numba recompiles a function when its own file changes, but not when a file of a function that it calls changes.
    """
    kernels = list(package.rglob("*.nbi"))
    if any(_older_than_source(kernel) for kernel in kernels):
        for path in [*kernels, *package.rglob("*.nbc")]:
            path.unlink(missing_ok=True)


def _older_than_source(kernel: Path) -> bool:
    source = kernel.parent.parent / f"{kernel.name.split('.')[0]}.py"
    with suppress(FileNotFoundError):  # deleted by another process
        return not source.exists() or source.stat().st_mtime > kernel.stat().st_mtime
    return False


class KernelCache(FunctionCache):
    """Cache of one function's kernels on the disk. A full disk does not end the run.

    Of several processes that need a kernel at once, one compiles it, and the others wait and load it.
    """

    def __init__(self, function: Callable[..., Any]) -> None:
        super().__init__(function)
        self._lock = Path(self.cache_path, f"{self._impl.filename_base}.lock")
        self._turn: int | None = None  # handle of the lock while this process compiles

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """The kernel from the disk; None if this process is to compile it."""
        found = super().load_overload(sig, target_context)
        if found is None and self._turn is None:
            self._wait_for_turn()
            found = super().load_overload(sig, target_context)  # another process may have compiled it meanwhile
            if found is not None:
                self._end_turn()
        return found

    def ends_turn(self, compile_: Callable[..., Any]) -> Callable[..., Any]:
        """The compiler of the function, which lets others have it when it fails."""

        def compile_or_end(*of: Any) -> Any:
            try:
                return compile_(*of)
            except BaseException:
                self._end_turn()
                raise

        return compile_or_end

    def save_overload(self, sig: Any, data: Any) -> None:
        """Save a kernel for later runs; warn if it cannot be saved."""
        try:
            super().save_overload(sig, data)
        except OSError as error:
            _warn_once(
                f"compiled kernels cannot be kept in {self.cache_path} ({error.strerror}); "
                "the next run compiles them again"
            )
        finally:
            self._end_turn()

    def _wait_for_turn(self) -> None:
        """Lock the function, where the file system has locks and as far as nobody hangs."""
        if sys.platform == "win32":
            return
        with suppress(OSError):
            self._lock.parent.mkdir(parents=True, exist_ok=True)
            self._turn = os.open(self._lock, os.O_RDWR | os.O_CREAT)
            until_s = monotonic() + _TURN_S
            while monotonic() < until_s and not _signals.waiting:
                try:
                    fcntl.flock(self._turn, fcntl.LOCK_EX | fcntl.LOCK_NB)
                    return
                except BlockingIOError:
                    sleep(_LOOK_S)

    def _end_turn(self) -> None:
        """Let others have the function; who waits for it finds the kernel."""
        if self._turn is not None:
            os.close(self._turn)  # the file stays: others may wait for it
            self._turn = None


@cache
def _warn_once(what: str) -> None:
    """Log a warning once."""
    log.warning(what)


_RULES: dict[str, Any] = {"no_cfunc_wrapper": True, "error_model": "numpy"}
"""The same for all kernels, since numba compiles its own functions once for each set of rules. C calls none of ours, so
none has a wrapper for that, an eighth less to compile; x / 0 is infinite or NaN."""


def kernel(function: Callable[..., Any]) -> Any:
    """Decorator: compile on the first call, cache for later runs, release the interpreter's lock."""
    compiled = njit(nogil=True, **_RULES)(function)
    if CACHE:  # by private names: numba has no public way to a cache other than its own, which a full disk ends
        compiled._cache = KernelCache(function)
        compiled._compiler.compile = compiled._cache.ends_turn(compiled._compiler.compile)
    return compiled


def inlined(function: Callable[..., Any]) -> Any:
    """Decorator: a function that only kernels call. It is compiled within each of them, under their rule of division.

    By itself it would be inferred, optimised and turned into machine code once more than is needed.
    It would also count references to each of its arrays at every call; views of rows, table[i], still do.
    """
    return njit(nogil=True, inline="always", **_RULES)(function)


def specialised(function: Callable[..., Any], *constants: int) -> Callable[..., Any]:
    """A compiled closure over constants, with the constants in its name.

    The cache is by name: closures of one name with other constants must not be confused.
    """
    name = "_".join([function.__name__, *map(str, constants)])
    function.__name__ = function.__qualname__ = name
    return kernel(function)


class SignalsWait(Listener):
    """Delays Ctrl-C and SIGTERM until the current kernel is compiled.

    An exception that a signal handler raises inside the compiler is lost in a callback of LLVM, or appears as an
    unrelated one.
    """

    def __init__(self) -> None:
        self._handlers: dict[int, Any] = {}  # handlers outside the compiler; empty: not compiling
        self._caught: list[int] = []

    @property
    def waiting(self) -> bool:
        """Whether a signal has come meanwhile."""
        return bool(self._caught)

    def on_start(self, event: Event) -> None:
        """The main thread enters the compiler, possibly nested."""
        if not self._handlers and current_thread() is main_thread():
            ours = [number for number in (signal.SIGINT, signal.SIGTERM) if signal.getsignal(number) is not None]
            self._handlers = {number: signal.signal(number, self._note) for number in ours}  # None: set by a host in C

    def on_end(self, event: Event) -> None:
        """The main thread leaves the compiler: raise the signals caught meanwhile."""
        if self._handlers and current_thread() is main_thread() and not global_compiler_lock.is_locked():
            for number, handler in self._handlers.items():
                signal.signal(number, handler)
            self._handlers = {}
            caught, self._caught = self._caught, []
            for number in caught:
                signal.raise_signal(number)

    def _note(self, number: int, frame: FrameType | None) -> None:
        self._caught.append(number)


class FewCollections(Listener):
    """Lets Python's collector of garbage rest while kernels are compiled: its passes over the compiler's many objects
    took a seventh of the time.
    """

    def __init__(self) -> None:
        self._usual = gc.get_threshold()
        self._depth = 0

    def on_start(self, event: Event) -> None:
        """A kernel is compiled, possibly for another one; one thread at a time holds the compiler's lock."""
        if not self._depth:
            self._usual = gc.get_threshold()
            gc.set_threshold(*_RARELY)
        self._depth += 1

    def on_end(self, event: Event) -> None:
        """It is compiled."""
        self._depth -= 1
        if not self._depth:
            gc.set_threshold(*self._usual)


class InCompiler(Listener):
    """Which threads compile or load a kernel, or wait for their turn."""

    def __init__(self) -> None:
        self._depth: dict[int, int] = {}  # by thread; one may enter again within

    def on_start(self, event: Event) -> None:
        """A thread asks for the compiler."""
        self._depth[get_ident()] = self._depth.get(get_ident(), 0) + 1

    def on_end(self, event: Event) -> None:
        """It gives the compiler back."""
        self._depth[get_ident()] -= 1
        if not self._depth[get_ident()]:
            del self._depth[get_ident()]

    @property
    def others(self) -> bool:
        """Whether other threads than this one are in it."""
        return any(thread != get_ident() for thread in list(self._depth))


def compiling() -> bool:
    """Whether another thread of this process compiles or loads a kernel now."""
    return _in_compiler.others


_signals = SignalsWait()
_in_compiler = InCompiler()
register("numba:compiler_lock", _signals)
register("numba:compiler_lock", _in_compiler)
register("numba:compile", FewCollections())
if IN_TREE:
    forget_stale(PACKAGE)
