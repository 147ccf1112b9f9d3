"""Flow and queue of each leg."""

import numpy as np
from made_up_day import write_day

from vidtrack.traffic.report.findings import read_findings
from vidtrack.traffic.report.legs import legs_of


def test_flow_is_of_the_watched_time_and_a_gap_is_not_zero(tmp_path):
    folder = write_day(tmp_path / "day", [6, 0, 3, 0], [1, 0, 0.5, 1])
    leg = legs_of(read_findings(folder))[0]
    assert leg.leg == "north"
    np.testing.assert_allclose(leg.flow, [24, np.nan, 24, 0])
    np.testing.assert_allclose(leg.queue, [0, np.nan, 0, 0])


def test_the_longest_queue_of_each_interval_that_it_lasts_into(tmp_path):
    queues = [("north", 100, 200, 3, 20.0), ("north", 800, 1000, 5, 31.0), ("south", 100, 200, 9, 60.0)]
    leg = legs_of(read_findings(write_day(tmp_path / "day", [6, 6, 6], queues=queues)))[0]
    assert leg.queue.tolist() == [5, 5, 0]
    assert leg.queue_m.tolist() == [31, 31, 0]


def test_the_length_of_queues_is_that_of_those_with_one(tmp_path):
    queues = [("north", 100, 200, 3, np.nan), ("north", 300, 1000, 5, 31.0), ("north", 1900, 2000, 2, np.nan)]
    leg = legs_of(read_findings(write_day(tmp_path / "day", [6, 6, 6, 6], queues=queues)))[0]
    assert leg.queue.tolist() == [5, 5, 2, 0]
    np.testing.assert_array_equal(leg.queue_m, [31, 31, np.nan, 0])


def test_a_leg_that_nobody_entered_has_zeros_where_it_was_watched(tmp_path):
    legs = legs_of(read_findings(write_day(tmp_path / "day", [6, 0, 3], [1, 0, 1])))
    assert [leg.leg for leg in legs] == ["north", "east", "south", "west"]
    for leg in legs[1:]:
        for values in (leg.flow, leg.queue, leg.queue_m):
            np.testing.assert_array_equal(values, [0, np.nan, 0])
