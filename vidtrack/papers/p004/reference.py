"""Results of an independent implementation of the crossing and nine-target experiments.

The paper has no such table. 10,000 runs each (150 with nine targets); the standard error of a share p is
sqrt(p (1 - p) / 10000).
"""

from __future__ import annotations

RUNS = 10_000
CLASSES = ("correct", "swap", "merge", "lost")

Shares = dict[tuple[str, str], tuple[float, float, float, float]]

CROSSING: dict[str, Shares] = {
    "axis-aligned, merged for 8 frames": {
        ("nn", "euclidean"): (0.7624, 0.0229, 0.2147, 0.0),
        ("gnn", "euclidean"): (0.9160, 0.0838, 0.0002, 0.0),
        ("nn", "decoupled"): (0.8812, 0.0039, 0.1130, 0.0019),
        ("gnn", "decoupled"): (0.9743, 0.0201, 0.0015, 0.0041),
        ("nn", "mahalanobis"): (0.8750, 0.0047, 0.1178, 0.0025),
        ("gnn", "mahalanobis"): (0.9676, 0.0238, 0.0027, 0.0059),
    },
    "turned by 45 degrees, merged for 8 frames": {
        ("nn", "euclidean"): (0.7637, 0.0207, 0.2156, 0.0),
        ("gnn", "euclidean"): (0.9165, 0.0834, 0.0001, 0.0),
        ("nn", "decoupled"): (0.7754, 0.0181, 0.2034, 0.0031),
        ("gnn", "decoupled"): (0.9083, 0.0846, 0.0016, 0.0055),
        ("nn", "mahalanobis"): (0.8711, 0.0050, 0.1216, 0.0023),
        ("gnn", "mahalanobis"): (0.9668, 0.0250, 0.0030, 0.0052),
    },
    "axis-aligned, never merged": {
        ("nn", "euclidean"): (0.9366, 0.0032, 0.0602, 0.0),
        ("gnn", "euclidean"): (0.9893, 0.0105, 0.0002, 0.0),
        ("nn", "decoupled"): (0.9616, 0.0004, 0.0352, 0.0028),
        ("gnn", "decoupled"): (0.9907, 0.0048, 0.0008, 0.0037),
        ("nn", "mahalanobis"): (0.9611, 0.0003, 0.0355, 0.0031),
        ("gnn", "mahalanobis"): (0.9899, 0.0050, 0.0008, 0.0043),
    },
    "turned by 45 degrees, never merged": {
        ("nn", "euclidean"): (0.9367, 0.0032, 0.0601, 0.0),
        ("gnn", "euclidean"): (0.9873, 0.0126, 0.0001, 0.0),
        ("nn", "decoupled"): (0.9526, 0.0006, 0.0438, 0.0030),
        ("gnn", "decoupled"): (0.9863, 0.0082, 0.0007, 0.0048),
        ("nn", "mahalanobis"): (0.9611, 0.0003, 0.0361, 0.0025),
        ("gnn", "mahalanobis"): (0.9911, 0.0044, 0.0006, 0.0039),
    },
}

NINE: dict[tuple[str, str], tuple[float, float]] = {
    ("nn", "euclidean"): (7.28, 0.075),
    ("gnn", "euclidean"): (1.173, 0.135),
    ("nn", "decoupled"): (3.12, 0.130),
    ("gnn", "decoupled"): (0.867, 0.112),
    ("nn", "mahalanobis"): (2.84, 0.128),
    ("gnn", "mahalanobis"): (0.653, 0.090),
}
"""Mean number of the nine targets with a wrong identity at the end, and its standard error."""
