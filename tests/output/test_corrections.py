"""corrections.csv: written whole, read back, and harmless in a spreadsheet."""

import pytest

from vidtrack.errors import ConfigError, FormatError
from vidtrack.output.corrections import HEADER, NAME, CorrectionsFile, read_corrections
from vidtrack.traffic.validation.audit import Correction

ROWS = (
    Correction("missed", 3.25, "north", "up"),
    Correction("wrong direction", 12.5, "north", "down", 0, 41),
    Correction("double", 13.0625, "=HYPERLINK(1)", "left", 2, 7),
    Correction("right", 14.0, "<b>a</b> ; |", "left", 0, 8),
)


def test_rows_come_back(tmp_path):
    assert read_corrections(tmp_path) == ()
    file = CorrectionsFile(tmp_path)
    file.replace(ROWS)
    assert file.rows == read_corrections(tmp_path) == ROWS
    file.replace(ROWS[:1])
    assert CorrectionsFile(tmp_path).rows == ROWS[:1]
    assert [path.name for path in tmp_path.iterdir()] == [NAME]


def test_no_cell_is_a_formula(tmp_path):
    CorrectionsFile(tmp_path).replace(ROWS)
    cells = [
        cell for line in (tmp_path / NAME).read_text(encoding="utf-8-sig").splitlines() for cell in line.split(",")
    ]
    assert "'=HYPERLINK(1)" in cells
    assert not any(cell.startswith(("=", "+", "-", "@")) for cell in cells)


def test_a_file_that_changed_meanwhile_is_left_alone(tmp_path):
    file = CorrectionsFile(tmp_path)
    CorrectionsFile(tmp_path).replace(ROWS[:2])
    with pytest.raises(ConfigError, match="changed by another program"):
        file.replace(ROWS)
    assert read_corrections(tmp_path) == ROWS[:2]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("verdict,time_s\nright,1\n", "does not have the columns"),
        ("", "does not have the columns"),
        (",".join(HEADER) + "\nfine,1,a,up,0,1\n", "line 2: verdict is 'fine'"),
        (",".join(HEADER) + "\nright,soon,a,up,0,1\n", "line 2: could not convert"),
        (",".join(HEADER) + "\nright,1,a,up,0,x\n", "line 2: invalid literal"),
    ],
)
def test_what_cannot_be_meant_is_named(tmp_path, text, words):
    (tmp_path / NAME).write_text(text)
    with pytest.raises(FormatError, match=words):
        read_corrections(tmp_path)
