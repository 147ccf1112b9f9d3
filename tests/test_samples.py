"""The numbered samples run and say something that makes sense."""

import re
import subprocess
import sys

import pytest
from command_line import ENVIRONMENT, ROOT, SAMPLES

EXPECTED = {
    "01_track_a_video.py": r"track \d+: .* s at \(\d+, \d+\) to .* px/s\n(.*\n)*1\d vehicles\n$",
    "02_bring_your_own_detections.py": r"track 1 confirmed, (.*\n)+ ?1 +2\d\d\..*\((5|6)\d, -?\d\)\n ?2 +1\d\d\.",
    "03_count_over_a_line.py": r"^\d\.\d+ s: track \d to the right\ncrossings: \{'to the right': 1\}\n$",
    "04_track_radar_plots.py": r"\n +1 +7\.\d\d .*\( +1[45]\d, .*\n +\d+ +8\.9.* 1[78]\d\) .*\n$",
}


def test_every_sample_is_run_here():
    assert {path.name for path in SAMPLES.glob("*.py")} == set(EXPECTED)


@pytest.mark.parametrize("name", EXPECTED)
def test_sample_runs(name):
    command = [sys.executable, f"samples/{name}"]
    done = subprocess.run(command, cwd=ROOT, env=ENVIRONMENT, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stderr
    assert re.search(EXPECTED[name], done.stdout), done.stdout
    assert done.stderr == ""
