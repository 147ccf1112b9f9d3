"""What the tests of live runs share."""

import pytest
from cameras import HttpCamera, crossing
from command_line import SAMPLES

from vidtrack.config import load
from vidtrack.run import Run


@pytest.fixture(scope="session")
def compiled(tmp_path_factory):
    """Compiling would take the time in which the camera shows something."""
    folder = tmp_path_factory.mktemp("compiled") / "out"
    with Run(str(SAMPLES / "crossing.avi"), load(assignments=["source.end_s=2"]), folder) as run:
        for _ in run:
            pass


@pytest.fixture
def camera(compiled):
    """The sample at four times its speed."""
    with HttpCamera(crossing(), fps=60.0) as camera:
        yield camera
