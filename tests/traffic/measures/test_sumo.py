"""Counts, queues and conflicts beside those of SUMO's own detectors, which know nothing of ours."""

import importlib
import sys
from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest

TOOLS = Path(__file__).parents[3] / "tools"


@pytest.fixture(scope="module")
def tool():
    sys.path.insert(0, str(TOOLS))
    try:
        return importlib.import_module("compare_sumo")
    finally:
        sys.path.remove(str(TOOLS))


@pytest.fixture(scope="module")
def sumo(tool):
    if tool.binary("sumo") is None or tool.binary("netconvert") is None:
        pytest.skip("needs SUMO: pip install eclipse-sumo, and SUMO_HOME its folder sumo")
    return tool


def test_a_queue_without_a_length_is_compared_by_its_vehicles(tool, tmp_path):
    jam = '<interval id="west" begin="5" maxJamLengthInVehicles="2" maxJamLengthInMeters="9"/>'
    (tmp_path / "e2.xml").write_text(f"<detector>{jam}</detector>")
    row = {"leg": "west", "begin_s": 4.0, "end_s": 9.0, "vehicles": 3}
    ours = pa.Table.from_pylist([row | {"length_m": 10.5}, row | {"length_m": None}])
    vehicles, metres, alone = tool.queues(tmp_path, {"queues": ours})
    assert (vehicles.tolist(), metres.tolist(), alone) == ([1, 1], [1.5], 0)


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
