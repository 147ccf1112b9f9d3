"""What all tests share."""

import logging
import signal

import pytest
from hypothesis import settings

settings.register_profile("unhurried", deadline=None)  # a busy machine is no failure
settings.load_profile("unhurried")
signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell switches it off for what it starts in the background

CLOCKED = ("tests/run/live/", "tests/serve/")


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config, log):
    """Workers take whole files; those that watch a camera or a page by the clock never run beside each other."""
    from xdist.scheduler import LoadFileScheduling

    class Scheduling(LoadFileScheduling):
        def _split_scope(self, nodeid):
            return "clocked" if nodeid.startswith(CLOCKED) else super()._split_scope(nodeid)

    return Scheduling(config, log)


@pytest.fixture(autouse=True)
def own_log():
    """What a command called in this process, or in a fixture of the module, sets about the log ends with the test."""
    yield
    logger = logging.getLogger("vidtrack")
    logger.handlers = []
    logger.setLevel(logging.NOTSET)
