"""What the tests of live runs share."""

import pytest
from cameras import HttpCamera, crossing
from command_line import SAMPLES

from vidtrack.config.load import load
from vidtrack.run.files import run_file


@pytest.fixture(autouse=True)
def unhurried(monkeypatch):
    """A slow machine gets the time that it needs to answer and to end a run: what is tested is what comes then."""
    monkeypatch.setattr("vidtrack.run.live.run._END_S", 60.0)
    monkeypatch.setattr("vidtrack.run.live.supervisors._END_S", 60.0)
    monkeypatch.setattr("vidtrack.run.live.supervisor.END_S", 60.0)
    monkeypatch.setattr("vidtrack.run.live.supervisor._ANSWER_S", 60.0)
    monkeypatch.setattr("vidtrack.video.live.source._END_S", 10.0)


@pytest.fixture(scope="session")
def compiled(tmp_path_factory):
    """What a test starts should track, and not compile."""
    folder = tmp_path_factory.mktemp("compiled") / "out"
    with run_file(str(SAMPLES / "crossing.avi"), load(), folder) as run:
        for _ in run:
            pass


@pytest.fixture
def camera(compiled):
    """The sample at four times its speed."""
    with HttpCamera(crossing(), fps=60.0) as camera:
        yield camera
