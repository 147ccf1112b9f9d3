"""Association methods by the names that users give them."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from vidtrack.associate.generalized_nn import GeneralizedNN
from vidtrack.associate.hard import GNN, NN, Associator
from vidtrack.associate.jpda import JPDA
from vidtrack.associate.pda import PDA
from vidtrack.associate.strongest import PSN, StrongestNeighbour

METHODS: dict[str, Callable[[], Associator]] = {
    "nn": NN,
    "gnn": GNN,
    "generalized-nn": GeneralizedNN,
    "sn": StrongestNeighbour,
    "psn": PSN,
    "pda": PDA,
    "jpda": JPDA,
    "jpda-star": partial(JPDA, star=True),
}
"""They take no arguments: each problem holds all data."""

STRENGTH = ("sn", "psn")
"""Methods that choose by amplitude or score. They refuse scans with neither."""
