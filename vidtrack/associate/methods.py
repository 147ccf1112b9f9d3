"""Association methods by the names that users give them."""

from __future__ import annotations

from collections.abc import Callable

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
}
"""What an associator needs to know comes with each problem."""

STRENGTH = ("sn", "psn")
"""Those that choose by amplitude or score, and refuse scans with neither."""
