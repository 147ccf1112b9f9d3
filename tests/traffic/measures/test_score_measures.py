"""The tool that scores measures refuses what it cannot do in one line."""

import subprocess
import sys
from pathlib import Path

TOOLS = Path(__file__).parents[3] / "tools"


def test_a_reach_without_points_is_refused(tmp_path):
    asked = [sys.executable, TOOLS / "score_measures.py", "--reach", "nan", tmp_path]
    said = subprocess.run(list(map(str, asked)), capture_output=True, text=True)
    assert said.returncode == 2
    assert said.stderr.splitlines()[-1].endswith("adds no points: the nearest are 19 m along the legs")
    assert "Traceback" not in said.stderr
