"""What all tests share."""

import gc
import logging
import os
import signal
import sys

import pytest
from hypothesis import settings

from vidtrack.cli import main

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before NumPy: the threads of several workers wait for each other
settings.register_profile("unhurried", deadline=None)  # a busy machine is no failure
settings.load_profile("unhurried")
signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell switches it off for what it starts in the background
if "PYTEST_XDIST_WORKER" in os.environ:  # until all tests are collected: the search for garbage took half of that time
    gc.disable()

CLOCKED = ("tests/run/live/", "tests/serve/")
UNCLOCKED = tuple(
    f"tests/{name}.py"
    for name in (
        *(
            f"run/live/test_live_{of}"
            for of in ("clock", "leave", "level", "muxer", "parts", "places", "station_day", "status", "trouble")
        ),
        *(f"serve/test_serve_{of}" for of in ("browser", "counts", "review", "site", "site_browser", "site_file")),
        "serve/test_serve_site_command",
    )
)
"""Files there with neither a camera nor a limit of time: their pages are of finished runs, or of cameras made up"""
LONG = tuple(
    f"tests/{name}.py"
    for name in (
        "serve/test_serve_site_browser", "doctor/test_doctor_advice", "test_frame_rate", "traffic/test_site_runs",
        "papers/test_registry", "test_samples", "run/batch/test_command", "serve/test_serve_browser",
        "run/live/test_live_trouble",
    )
)  # fmt: skip
"""Files that no worker should begin when the others are nearly done"""

LONGEST = tuple(
    f"tests/{name}"
    for name in (
        "papers/test_registry.py::test_every_experiment_writes_a_picture_and_a_table_and_says_what_came_out[004-fig7]",
        "simulate/roads/test_roads_clip.py::test_visibility_is_the_share_of_pixels_left_by_what_is_nearer",
        "simulate/roads/test_roads_files.py::test_crossings_agree_with_brute_force_in_the_picture[motorway]",
        "doctor/test_doctor_advice.py::test_following_the_advice_helps",
        "tracking/unresolved/test_unresolved.py::test_branches_go_on_from_a_saved_state",
        "papers/test_p003.py::test_mean_errors_of_flights",
        "traffic/calibration/test_straight_road.py::test_errors_have_the_covariance_that_is_given",
        "traffic/calibration/test_calibrate.py::test_errors_have_the_covariance_that_is_given",
        "traffic/calibration/test_calibrate.py::test_good_pairs_are_rarely_blamed",
        "traffic/test_footprint.py::test_shared_errors_have_the_covariance_that_is_given",
        "radar/test_radar_choices.py::test_each_track_has_a_threshold_of_its_own",
        "test_frame_rate.py::test_ten_and_thirty_frames_a_second_tell_the_same",
    )
)
"""Tests of many seeds or whole clips, which VIDTRACK_LONG=1 runs too"""


def _is_clocked(nodeid):
    return nodeid.startswith(CLOCKED) and not nodeid.startswith(UNCLOCKED)


def pytest_collection_modifyitems(items):
    """What takes longest comes first, or is left out."""
    if not os.environ.get("VIDTRACK_LONG"):
        for item in items:
            if item.nodeid.startswith(LONGEST):
                item.add_marker(pytest.mark.skip(reason="takes long: VIDTRACK_LONG=1 runs it"))
    items.sort(key=lambda item: (not _is_clocked(item.nodeid), not item.nodeid.startswith(LONG)))


def pytest_collection_finish():
    """What is collected stays to the end: the search for garbage begins, and leaves it out."""
    gc.freeze()
    gc.enable()


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config, log):
    """Workers take whole files; those that watch a camera or a page by the clock never run beside each other."""
    from xdist.scheduler import LoadFileScheduling

    class Scheduling(LoadFileScheduling):
        def _split_scope(self, nodeid):
            return "clocked" if _is_clocked(nodeid) else super()._split_scope(nodeid)

    config.option.loadscopereorder = False  # the order of the items, not the number of tests in a file
    return Scheduling(config, log)


@pytest.fixture(autouse=True)
def own_log():
    """What a command called in this process, or in a fixture of the module, sets about the log ends with the test."""
    yield
    logger = logging.getLogger("vidtrack")
    logger.handlers = []
    logger.setLevel(logging.NOTSET)


@pytest.fixture
def vidtrack(tmp_path, monkeypatch, capfd):
    """Calls a command in this process, in an empty folder; gives its exit code, stdout and stderr."""
    monkeypatch.chdir(tmp_path)
    before = signal.getsignal(signal.SIGTERM)

    def call(*arguments):
        monkeypatch.setattr(sys, "argv", ["vidtrack", *map(str, arguments)])
        with pytest.raises(SystemExit) as ended:
            main()
        out, err = capfd.readouterr()
        assert "Traceback" not in out + err
        return ended.value.code or 0, out, err

    yield call
    signal.signal(signal.SIGTERM, before)
