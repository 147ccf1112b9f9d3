"""A rehearsal runs without compiled code, and then compiles what it called, the last first."""

import numpy as np
import pytest
from numba.core.registry import CPUDispatcher

from vidtrack.compiled import inlined, kernel
from vidtrack.rehearsal import rehearse


@inlined
def half(x):
    return x / 2


@kernel
def first(x):
    return half(x[0])


@kernel
def last(x, n):
    return x[n] + 1


def play(told, seen):
    x = np.arange(3.0)
    assert first(x) == 0
    assert last(x, 2) == 3
    last(x, 1)
    seen.append((told, [len(each.signatures) for each in (first, last)]))


def test_kernels_are_compiled_after_the_play_and_from_the_last_to_the_first(monkeypatch):
    seen, order, compile_ = [], [], CPUDispatcher.compile

    def noted(self, types):
        order.append(self)
        return compile_(self, types)

    monkeypatch.setattr(CPUDispatcher, "compile", noted)
    rehearse(play, "told", seen)
    assert seen == [("told", [0, 0])]
    assert [each for each in order if each in (first, last)] == [last, first]
    assert [len(each.signatures) for each in (first, last, half)] == [1, 1, 0]
    play("again", seen)  # compiled code, of the same types
    assert seen[1:] == [("again", [1, 1])]


def test_calls_are_of_compiled_code_again_where_a_play_fails():
    with pytest.raises(ZeroDivisionError):
        rehearse(lambda: 1 / 0)
    assert "__call__" not in vars(CPUDispatcher)
