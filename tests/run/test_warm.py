"""What is compiled ahead is all that a run over video needs, and each kernel of it once."""

import subprocess
import sys
from pathlib import Path

import pytest
from numba.core.dispatcher import Dispatcher

import vidtrack
from vidtrack.config.settings import Settings, SourceSettings
from vidtrack.run.video import track
from vidtrack.run.warm import warm, warm_beside

SAMPLES = Path(__file__).parents[2] / "samples"
TWICE = {"vidtrack.video.background.filters._weigh"}  # decoders pad the rows of some pictures


def compiled():
    """Signatures of each kernel that is compiled or loaded, by name."""
    return {
        f"{name}.{function.py_func.__name__}": frozenset(map(str, function.signatures))
        for name, module in list(sys.modules.items())
        if name.startswith("vidtrack")
        for function in vars(module).values()
        if isinstance(function, Dispatcher) and function.py_func.__module__ == name and function.signatures
    }


@pytest.fixture(scope="module")
def ahead():
    """What `warm` compiles, apart from what was there before it in this process."""
    before = compiled()
    warm()
    return {name: found - before.get(name, frozenset()) for name, found in compiled().items()}


def test_a_run_after_it_compiles_nothing(ahead):
    before = compiled()
    for _ in track(SAMPLES / "junction.avi", Settings(source=SourceSettings(end_s=4.0))):
        pass
    assert compiled() == before


def test_no_kernel_is_compiled_for_two_kinds_of_numbers(ahead):
    assert {name for name, found in ahead.items() if len(found) > 1} <= TWICE


def test_the_process_beside_a_first_run_compiles_this_package_in_whatever_folder(tmp_path, monkeypatch):
    (tmp_path / "vidtrack").mkdir()
    (tmp_path / "vidtrack" / "__init__.py").touch()  # as a clone, of which an installed copy tracks the sample
    told, begin = [], subprocess.Popen

    def asked(command, **where):
        process = begin([*command[:2], "import vidtrack; print(vidtrack.__file__)"], stdout=subprocess.PIPE, **where)
        told.append(process.communicate()[0].decode().strip())
        return process

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(subprocess, "Popen", asked)
    monkeypatch.setattr("vidtrack.run.warm.cpu_count", lambda: 2)
    monkeypatch.setattr("vidtrack.run.warm.CACHE", True)
    warm_beside()
    assert told == [vidtrack.__file__]
