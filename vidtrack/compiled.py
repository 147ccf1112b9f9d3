"""Where compiled kernels are kept between runs."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

from numba import njit
from numba.misc.appdirs import AppDirs

PACKAGE = Path(__file__).parent


def _writable(folder: Path) -> bool:
    """Whether files can be made in a folder, or in the nearest one above it that exists."""
    while not folder.exists():
        folder = folder.parent
    return os.access(folder, os.W_OK)


IN_TREE = _writable(PACKAGE / "__pycache__")
CACHE = bool(os.environ.get("NUMBA_CACHE_DIR")) or IN_TREE or _writable(Path(AppDirs("numba", False).user_cache_dir))
"""Whether kernels can be cached: numba refuses to compile a cached function where it finds no place to write.

Without one, as in a read-only container, each run compiles anew; NUMBA_CACHE_DIR names another place.
"""


def first_run() -> bool:
    """Whether the kernels are still to be compiled, as far as the package's own folders tell."""
    return IN_TREE and not os.environ.get("NUMBA_CACHE_DIR") and not any(PACKAGE.rglob("*.nbi"))


def specialised(function: Callable[..., Any], *constants: int) -> Callable[..., Any]:
    """A compiled closure over constants, under a name of its own.

    Kernels of one name but other constants, cached by different processes, must not meet in a later one.
    """
    name = "_".join([function.__name__, *map(str, constants)])
    function.__name__ = function.__qualname__ = name
    return njit(cache=CACHE, nogil=True, error_model="numpy")(function)
