"""Traffic video with exact truth: scenes as data, drawn by a camera with noise, shake and light changes."""

from vidtrack.simulate.clip import SCENARIOS, Clip, simulate
from vidtrack.simulate.truth import Truth
from vidtrack.simulate.write import write

__all__ = ["SCENARIOS", "Clip", "Truth", "simulate", "write"]
