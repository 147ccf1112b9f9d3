"""What all tests share."""

import logging
import signal

import pytest
from hypothesis import settings

settings.register_profile("unhurried", deadline=None)  # a busy machine is no failure
settings.load_profile("unhurried")
signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell switches it off for what it starts in the background

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


def _is_clocked(nodeid):
    return nodeid.startswith(CLOCKED) and not nodeid.startswith(UNCLOCKED)


def pytest_collection_modifyitems(items):
    """What takes longest comes first."""
    items.sort(key=lambda item: (not _is_clocked(item.nodeid), not item.nodeid.startswith(LONG)))


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
