"""What is compiled ahead is all that a run over video needs, and each kernel of it once."""

import sys
from pathlib import Path

import pytest
from numba.core.dispatcher import Dispatcher

from vidtrack.config.settings import Settings, SourceSettings
from vidtrack.run.video import track
from vidtrack.run.warm import warm

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
