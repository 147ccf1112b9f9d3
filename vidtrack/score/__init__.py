"""Tracks against truth: CLEAR, identity (IDF1), HOTA, OSPA and GOSPA, consistency."""

from vidtrack.score.clear import Clear, clear
from vidtrack.score.consistency import Consistency, consistency, nees
from vidtrack.score.hota import Hota, hota
from vidtrack.score.identity import Identity, identity
from vidtrack.score.matching import Matchup, match_boxes, match_points
from vidtrack.score.ospa import Gospa, Ospa, gospa, ospa
from vidtrack.score.pooling import pool
from vidtrack.score.report import evaluate

__all__ = [
    "Clear",
    "Consistency",
    "Gospa",
    "Hota",
    "Identity",
    "Matchup",
    "Ospa",
    "clear",
    "consistency",
    "evaluate",
    "gospa",
    "hota",
    "identity",
    "match_boxes",
    "match_points",
    "nees",
    "ospa",
    "pool",
]
