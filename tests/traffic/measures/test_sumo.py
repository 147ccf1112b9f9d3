"""Counts, queues and conflicts beside those of SUMO's own detectors, which know nothing of ours."""

import importlib
import sys
from pathlib import Path

import numpy as np
import pytest

TOOLS = Path(__file__).parents[3] / "tools"


@pytest.fixture(scope="module")
def sumo():
    sys.path.insert(0, str(TOOLS))
    try:
        tool = importlib.import_module("compare_sumo")
    finally:
        sys.path.remove(str(TOOLS))
    if tool.binary("sumo") is None or tool.binary("netconvert") is None:
        pytest.skip("needs SUMO: pip install eclipse-sumo, and SUMO_HOME its folder sumo")
    return tool


def test_sumo_s_detectors_see_the_same(sumo, tmp_path):
    tables = sumo.compared(tmp_path, seconds=240.0, seed=2)
    counts, speeds = sumo.loops(tmp_path, tables)
    assert counts.sum(axis=0).min() > 100
    assert np.abs(counts[:, 0] - counts[:, 1]).max() <= 1  # at the edge of a minute
    assert abs(counts[:, 0].sum() - counts[:, 1].sum()) <= 2
    assert np.abs(speeds).max() < 3
    vehicles, _, alone = sumo.queues(tmp_path, tables)
    assert len(vehicles) >= 5
    assert np.abs(vehicles).max() <= 1
    assert alone == 0
    for theirs, mine, late in sumo.conflicts(tmp_path, tables).values():
        assert mine >= theirs > 3
        assert len(late) >= 0.95 * theirs - 1
        assert np.median(np.abs(late)) < 0.02
