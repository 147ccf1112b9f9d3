"""The shape of the package: imports point downwards, heavy libraries stay where they belong."""

import ast
import re
import subprocess
import sys
from functools import cache
from pathlib import Path

import pytest

from vidtrack.cli import COMMANDS

ROOT = Path(__file__).parent.parent
PACKAGE = ROOT / "vidtrack"
FLOORS = (
    "__main__",
    "cli",
    "papers",
    "doctor",
    "service",
    "run",
    "recording",
    "serve",
    "simulate",
    "output",
    "score",
    "traffic",
    "detections",
    "video",
    "radar",
    "tracking",
    "associate",
    "estimate",
    "amplitude",
    "formats",
    "scan",
    "tracks",
    "decision",
    "arrays",
    "config",
    "state",
    "errors",
    "rehearsal",
    "beside",
    "compiled",
)
"""From the top: a file may import its own floor and those below it."""


def modules():
    """(dotted name without `vidtrack.`, path) of every file but the package's front door."""
    for path in sorted(PACKAGE.rglob("*.py")):
        parts = path.relative_to(PACKAGE).with_suffix("").parts
        if parts != ("__init__",):
            yield ".".join(part for part in parts if part != "__init__"), path


MODULES = dict(modules())


@cache
def nodes_of(name):
    """All nodes of the syntax tree of a module."""
    return list(ast.walk(ast.parse(MODULES[name].read_text(encoding="utf-8"))))


def imported(nodes):
    """Full names of all modules that a file imports anywhere, those for type checkers only left out."""
    for_types = {
        node
        for block in nodes
        if isinstance(block, ast.If) and isinstance(block.test, ast.Name) and block.test.id == "TYPE_CHECKING"
        for node in ast.walk(block)
    }
    for node in nodes:
        if node in for_types:
            continue
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, "imports are written in full"
            for alias in node.names:  # `from package import module` is about the module
                module = f"{node.module}.{alias.name}"
                yield module if module.removeprefix("vidtrack.") in MODULES else node.module


@cache
def imports_of(name):
    return set(imported(nodes_of(name)))


def floor(name):
    return FLOORS.index(name.split(".")[0])


def own(names):
    """The package's modules among imported names."""
    return {name.removeprefix("vidtrack.") for name in names} & set(MODULES)


def users_of(library):
    """The modules that import a library, or a part of it."""
    return {name for name in MODULES if any(f"{found}.".startswith(f"{library}.") for found in imports_of(name))}


def test_imports_point_downwards():
    upwards = {(name, other) for name in MODULES for other in own(imports_of(name)) if floor(other) < floor(name)}
    assert not upwards


def test_no_module_imports_itself_by_way_of_others():
    waiting = {name: own(imports_of(name)) - {name} for name in MODULES}
    while free := [name for name, needs in waiting.items() if not needs & set(waiting)]:
        for name in free:
            del waiting[name]
    assert not waiting, "these import each other"


def test_rerun_is_imported_where_recordings_are_made():
    assert users_of("rerun") == {"output.rerun.recording", "output.rerun.pictures", "output.rerun.plots"}


def test_opencv_is_used_where_there_are_pictures():
    assert {name.split(".")[0] for name in users_of("cv2")} <= {"video", "output", "simulate", "papers"}


@pytest.mark.parametrize("library", ["matplotlib", "jinja2", "click", "rich", "starlette", "tomlkit", "uvicorn"])
def test_libraries_for_people_stay_out_of_the_core(library):
    allowed = {"matplotlib": {"output", "papers"}, "jinja2": {"output"}, "click": {"cli", "__main__"}, "rich": {"cli"}}
    allowed |= {"starlette": {"serve"}, "tomlkit": {"serve"}, "uvicorn": {"serve"}}
    assert {name.split(".")[0] for name in users_of(library)} <= allowed[library]


def test_nothing_is_pickled_and_nobody_prints():
    assert not users_of("pickle")
    printing = [
        name
        for name in MODULES
        for node in nodes_of(name)
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "print"
    ]
    assert not printing


def test_files_hold_one_idea():
    lengths = {path: len(path.read_text(encoding="utf-8").splitlines()) for path in PACKAGE.rglob("*.py")}
    assert not {path.name: length for path, length in lengths.items() if length > 400}


def run(code):
    return subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, timeout=120, check=False
    )


HEAVY = {
    *("av", "cv2", "jinja2", "matplotlib", "numba", "numpy", "pandas", "pyarrow", "pydantic", "rerun", "rich", "scipy"),
    *("scipy.optimize", "scipy.spatial", "scipy.special", "scipy.stats", "starlette"),
}
COMPILED = {"numpy", "numba", "scipy", "scipy.special"}


def heavy(code):
    """The heavy libraries that a fresh process has loaded after this code."""
    result = run(f"import sys\n{code}\nprint(*sorted({HEAVY} & set(sys.modules)))")
    assert result.returncode == 0, result.stderr
    return set(result.stdout.splitlines()[-1].split())


@pytest.fixture(scope="module")
def loaded_for_help():
    """The heavy libraries that a process has loaded after the help of each command, one after the other."""
    code = f"""
import sys
from vidtrack.cli import cli
for name in {["", *COMMANDS]}:
    cli.main([*filter(None, [name]), "--help"], standalone_mode=False)
    print(f"loaded for {{name or 'all'}}:", *sorted({HEAVY} & set(sys.modules)))
"""
    result = run(code)
    assert result.returncode == 0, result.stderr
    lines = re.findall("^loaded for (.+):(.*)$", result.stdout, re.MULTILINE)
    return {name: found.split() for name, found in lines}


@pytest.mark.parametrize("name", ["all", *COMMANDS])
def test_help_imports_nothing_heavy(loaded_for_help, name):
    assert not loaded_for_help[name]


@pytest.mark.parametrize(
    ("name", "needed"),
    {
        "Error": set(),
        "Settings": {"pydantic"},
        "Scan": {"numpy"},
        "Tracks": {"numpy"},
        "Tracker": COMPILED,
        "FixedGainBank": COMPILED,
        "box_tracker": {*COMPILED, "pydantic"},
        "track": {*COMPILED, "pydantic", "cv2", "av"},
        "track_plots": {*COMPILED, "pydantic", "pyarrow"},
    }.items(),
)
def test_a_name_imports_what_it_needs(name, needed):
    assert heavy(f"import vidtrack\nvidtrack.{name}") <= needed


def test_no_part_needs_all_of_scipy_stats():
    assert not users_of("scipy.stats")


@pytest.mark.parametrize("first", ["Tracker", "track"])
def test_public_names_are_what_they_say_in_any_order(first):
    """`track` is a function and also the name of a sub-package: importing the latter must not hide the former."""
    result = run(
        "import vidtrack as vt\n"
        f"vt.{first}\n"
        "for name in vt.__all__: assert getattr(vt, name) is not None, name\n"
        "import inspect\n"
        "assert inspect.isfunction(vt.track), vt.track\n"
        "assert inspect.isclass(vt.Tracker)\n"
        "assert issubclass(vt.ScanError, vt.Error)\n"
        "import vidtrack.tracking.register\n"
        "assert inspect.isfunction(vt.track), vt.track\n"
    )
    assert result.returncode == 0, result.stderr


def test_the_page_on_the_architecture_names_what_there_is():
    page = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
    named = re.findall(r"`([\w/]+(?:\.py|/))`", page)
    rooms = [ROOT, PACKAGE, *(path for path in PACKAGE.rglob("*") if path.is_dir())]
    assert not {name for name in named if not any((room / name).exists() for room in rooms)}
    assert set(FLOORS) - {"__main__"} <= {name.rstrip("/").removesuffix(".py") for name in named}
