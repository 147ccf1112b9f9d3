"""CSV cells that a spreadsheet takes for words."""

import csv
import re

from hypothesis import given
from hypothesis import strategies as st

from vidtrack.output.report.spreadsheet import write_sheet


def read(path):
    with path.open(encoding="utf-8-sig", newline="") as file:
        return list(csv.reader(file))


def test_numbers_words_and_empty_cells(tmp_path):
    write_sheet(tmp_path / "a.csv", ["x", "=y"], [[1, 2.5], [-3.0, None], [float("nan"), "a, b"], ["-1 or so", "ü"]])
    assert read(tmp_path / "a.csv") == [["x", "'=y"], ["1", "2.5"], ["-3", ""], ["", "a, b"], ["'-1 or so", "ü"]]


@given(st.text(alphabet=st.characters(blacklist_categories=("Cs",)), min_size=1))
def test_no_word_is_a_formula_and_none_is_lost(tmp_path_factory, word):
    path = tmp_path_factory.getbasetemp() / "cell.csv"
    write_sheet(path, ["word"], [[word]])
    (_, (cell,)) = read(path)
    assert cell.lstrip()[:1] not in {*"=+-@＝＋－＠"}
    assert cell.removeprefix("'") == re.sub(r"[\x00-\x1f]", " ", word).removeprefix("'")
