"""Traffic video and radar plots with exact truth.

Video: scenes as data, drawn by a camera with noise, shake and light changes; `roads`: traffic over a road plane in
perspective. Radar: flights, seen with errors, misses and clutter; that part needs no OpenCV.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from vidtrack.simulate.clip import SCENARIOS as SCENARIOS
    from vidtrack.simulate.clip import Clip as Clip
    from vidtrack.simulate.clip import simulate as simulate
    from vidtrack.simulate.roads.clip import RoadClip as RoadClip
    from vidtrack.simulate.roads.clip import simulate_road as simulate_road
    from vidtrack.simulate.roads.write import write_road as write_road
    from vidtrack.simulate.truth import Truth as Truth
    from vidtrack.simulate.video_write import write as write

_HOME = {"SCENARIOS": "clip", "Clip": "clip", "Truth": "truth", "simulate": "clip", "write": "video_write"}
_HOME |= {"RoadClip": "roads.clip", "simulate_road": "roads.clip", "write_road": "roads.write"}
__all__ = sorted(_HOME)


def __getattr__(name: str) -> Any:
    """Import a name of the video part when it is first used."""
    if name not in _HOME:
        raise AttributeError(f"module vidtrack.simulate has no attribute {name}")
    return getattr(import_module(f"vidtrack.simulate.{_HOME[name]}"), name)
