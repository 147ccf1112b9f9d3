"""The sites in docs/traffic.md are valid, and calibrate without a complaint."""

import re
from pathlib import Path

import pytest

from vidtrack.traffic.calibration.account import examined
from vidtrack.traffic.site import read_site

TEXT = (Path(__file__).parents[2] / "docs" / "traffic.md").read_text(encoding="utf-8")
BLOCKS = [
    re.sub("(?m)^    ", "", block)
    for block in re.findall(r"(?:^    .*\n|^\n(?=    ))+", TEXT, re.MULTILINE)
    if "[calibration]" in block
]


@pytest.mark.parametrize("number", range(len(BLOCKS)))
def test_a_documented_site_is_good(tmp_path, number):
    head = "" if "[site]" in BLOCKS[number] else '[site]\nname = "road"\nwidth = 1280\nheight = 720\n'
    (tmp_path / "site.toml").write_text(head + BLOCKS[number])
    report = examined(read_site(tmp_path / "site.toml")).report
    assert not report["contradiction"]
    assert report["camera"]["height_m"] == pytest.approx(8, abs=0.5)


def test_both_kinds_of_calibration_are_documented():
    assert len(BLOCKS) == 2
