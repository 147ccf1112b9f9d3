"""Names of the available methods, filters and detectors, for settings, command line and factories."""

from __future__ import annotations

from typing import Literal

Decoder = Literal["auto", "software", "vaapi", "nvdec", "videotoolbox"]
Detector = Literal["disturbance", "paper", "mog2", "knn"]
LaterMethod = Literal["split", "mht"]
Method = Literal["nn", "gnn", "generalized-nn", "sn", "psn", "pda", "jpda", "jpda-star", LaterMethod]
Distance = Literal["mahalanobis", "decoupled", "euclidean"]
Life = Literal["m-of-n", "llr"]
Estimator = Literal["kalman", "converted", "ekf", "ukf", "imm", "alpha-beta", "particle"]
Model = Literal["cv", "ca", "singer", "ct"]
Level = Literal["counts", "tracks", "all"]
Resampling = Literal["none", "multinomial", "residual", "stratified", "systematic", "error-signal"]
