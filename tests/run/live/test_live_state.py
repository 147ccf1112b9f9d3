"""A state that cannot be used ends a run with a way out, or is set aside."""

import numpy as np
import pytest
from cameras import Picture, Script, grey, script_of
from live_runs import frames, run_until, settings

from vidtrack.errors import ConfigError, FormatError
from vidtrack.run.live.outputs import LiveExtras
from vidtrack.run.live.run import LiveRun
from vidtrack.state import read_state, write_state

NOT_OF_A_RUN = {"frame": 3, "time_s": "soon"}


def camera():
    acts = [act for k in range(400) for act in (0.004, Picture(grey(90 + k % 3), k / 25))]
    return script_of(*(Script(*acts) for _ in range(3)))


def run(folder, name, *assignments):
    extras = LiveExtras(state=folder / "cam.state")
    chosen = settings("live.backoff_s=0.01", *assignments)
    with LiveRun("rtsp://camera.local/1", chosen, folder / name, extras, connect=camera()) as live:
        return run_until(live, frames(5))


@pytest.fixture
def whole(tmp_path, compiled):
    run(tmp_path, "first")
    return tmp_path / "cam.state"


def damage(path, how):
    if how == "cut":
        path.write_bytes(path.read_bytes()[:-100])
    elif how == "noise":
        path.write_bytes(np.random.default_rng(1).bytes(5000))
    elif how == "other settings":
        state = read_state(path)
        write_state(path, state | {"tracker.nobody_knows": 3})
    else:
        write_state(path, NOT_OF_A_RUN)


@pytest.mark.parametrize("how", ["cut", "noise", "other settings", "no run"])
def test_a_state_that_cannot_be_used(tmp_path, whole, how):
    damage(whole, how)
    before = whole.read_bytes()
    with pytest.raises(FormatError, match=r"set it aside with --set live\.replace_state=true"):
        run(tmp_path, "second")
    assert whole.read_bytes() == before
    run(tmp_path, "third", "live.replace_state=true")
    (aside,) = tmp_path.glob("cam.state.unusable-*")
    assert aside.read_bytes() == before
    state = read_state(whole)
    assert state["tracker.register.next_id"] > 1e11
    seen = run(tmp_path, "fourth", "live.replace_state=true")
    assert len(list(tmp_path.glob("cam.state.unusable-*"))) == 1
    if how != "other settings":  # its numbers could be read
        assert seen[0].index > 1e11


def test_it_needs_a_state(tmp_path):
    with pytest.raises(ConfigError, match="no effect without --state"):
        LiveRun("rtsp://camera.local/1", settings("live.replace_state=true"), tmp_path, connect=camera())
