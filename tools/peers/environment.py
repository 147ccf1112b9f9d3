"""Virtual environments for the peers that the benchmarks compare with; none of them is a dependency.

norfair needs NumPy 1 and roboflow `trackers` NumPy 2, so there are two. They are made by pip once,
in the folder a benchmark is told, and used again as long as the list of packages stays the same.
"""

from __future__ import annotations

import subprocess
import venv
from pathlib import Path

HERE = Path(__file__).parent


def python_of(name: str, folder: Path) -> Path:
    """The interpreter of the environment `name` (of NAME.txt beside this file) in `folder`, made if it is not there."""
    wanted = HERE / f"{name}.txt"
    place = folder / name
    python, made_of = place / "bin" / "python", place / wanted.name
    if not made_of.is_file() or made_of.read_text() != wanted.read_text():
        venv.create(place, with_pip=True, clear=True)
        subprocess.run([python, "-m", "pip", "install", "--quiet", "-r", wanted], check=True)
        made_of.write_text(wanted.read_text())
    return python
