"""What stands at the axes and scales of a report's pictures."""

import re
from datetime import UTC, datetime
from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib.text import Text

from vidtrack.output.report import pictures
from vidtrack.output.report.style import drawing, time_axis
from vidtrack.traffic.clock import Clock
from vidtrack.traffic.report.paths import Heat


def texts(figure):
    """What is written, with the box of each (left, bottom, right, top) [px]."""
    figure.canvas.draw()
    return {one.get_text(): one.get_window_extent().extents for one in figure.findobj(Text) if one.get_text()}


@pytest.mark.parametrize(
    ("extent", "least", "most"), [((80.0, 60.0), 0.04, 0.5), ((76.0, 33.0), 0.04, 2.0), ((80.0, 60.0), 0.2, 0.21)]
)
def test_the_scale_of_a_heat_map_has_plain_numbers_and_its_whole_name(monkeypatch, extent, least, most):
    """Long and short scales; of a whole decade, and of less."""
    x, y = (np.linspace(0, side, 121) for side in extent)
    seconds = np.zeros((120, 120))
    seconds[10:30, 20] = np.geomspace(least, most, 20)
    gates = SimpleNamespace(segment=np.empty((0, 4)), legs=())
    monkeypatch.setattr(pictures, "png", lambda figure: figure)
    figure = pictures.heat_map(Heat(x, y, seconds), gates, metres=True)
    written = texts(figure)
    assert not [text for text in written if "$" in text]
    scale = figure.axes[1]
    numbers = [label.get_text() for label in scale.get_yticklabels() if label.get_text()]
    assert len(numbers) >= 2
    assert all(re.fullmatch(r"[\d.]+", number) for number in numbers)
    _, bottom, right, top = next(box for text, box in written.items() if text.startswith("vehicle-seconds"))
    assert bottom >= 0
    assert right <= figure.bbox.width
    assert top <= figure.bbox.height


@pytest.mark.parametrize("zero", [None, datetime(2026, 6, 1, 17, 38, tzinfo=UTC)])
@pytest.mark.parametrize(
    ("span", "unit"),
    [(0.4, "h:min:s"), (2.4, "h:min:s"), (7.0, "h:min:s"), (26.0, "h:min:s"), (300.0, "h:min"), (57600.0, "h:min")],
)
def test_an_axis_of_time_has_ticks_and_a_name_with_its_unit(span, unit, zero):
    with drawing(2.0) as (figure, axes):
        time_axis(axes[0, 0], Clock(zero), np.array([0.93, 0.93 + span]))
        figure.canvas.draw()
        labels = axes[0, 0].get_xticklabels()
        boxes = np.array([label.get_window_extent().extents for label in labels])
    assert 2 <= len(labels) == len({label.get_text() for label in labels}) <= 9
    assert (boxes[:-1, 2] < boxes[1:, 0]).all()
    what = "time since the first picture" if zero is None else "time of day"
    assert axes[0, 0].get_xlabel() == f"{what}, {unit}"
