"""What all tests share."""

import logging

import pytest
from hypothesis import settings

settings.register_profile("unhurried", deadline=None)  # a busy machine is no failure
settings.load_profile("unhurried")


@pytest.fixture(autouse=True)
def own_log():
    """What a command called in this process sets about the log ends with the test."""
    logger = logging.getLogger("vidtrack")
    before = logger.handlers, logger.level
    yield
    logger.handlers, logger.level = before
