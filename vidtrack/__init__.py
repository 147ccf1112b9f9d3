"""Vehicle tracks from traffic video and radar plots, on a plain CPU, without a neural network.

Names are imported on first use, so that `vidtrack --help` loads none of them. The block below serves type checkers and
editors, `_HOME` the interpreter.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from vidtrack.amplitude.threshold import ThresholdController as ThresholdController
    from vidtrack.associate.gate import Gate as Gate
    from vidtrack.associate.gate import LikelihoodGate as LikelihoodGate
    from vidtrack.associate.generalized_nn import GeneralizedNN as GeneralizedNN
    from vidtrack.associate.hard import GNN as GNN
    from vidtrack.associate.hard import NN as NN
    from vidtrack.associate.hard import GreedyGNN as GreedyGNN
    from vidtrack.associate.jpda import JPDA as JPDA
    from vidtrack.associate.pda import PDA as PDA
    from vidtrack.associate.strongest import PSN as PSN
    from vidtrack.associate.strongest import StrongestNeighbour as StrongestNeighbour
    from vidtrack.config.load import load as load_settings  # noqa: F401
    from vidtrack.config.settings import Settings as Settings
    from vidtrack.errors import ConfigError as ConfigError
    from vidtrack.errors import Error as Error
    from vidtrack.errors import FormatError as FormatError
    from vidtrack.errors import OutputError as OutputError
    from vidtrack.errors import PlotFormatError as PlotFormatError
    from vidtrack.errors import ScanError as ScanError
    from vidtrack.errors import SourceError as SourceError
    from vidtrack.errors import StoppedEarly as StoppedEarly
    from vidtrack.estimate.fixed_gain import FixedGainBank as FixedGainBank
    from vidtrack.estimate.imm import IMMBank as IMMBank
    from vidtrack.estimate.kalman import KalmanBank as KalmanBank
    from vidtrack.estimate.motion.acceleration import ConstantAcceleration as ConstantAcceleration
    from vidtrack.estimate.motion.acceleration import Singer as Singer
    from vidtrack.estimate.motion.turn import CoordinatedTurn as CoordinatedTurn
    from vidtrack.estimate.motion.velocity import ConstantVelocity as ConstantVelocity
    from vidtrack.estimate.particle import ParticleBank as ParticleBank
    from vidtrack.estimate.unscented import UnscentedBank as UnscentedBank
    from vidtrack.radar.sensors import PositionRangeRate as PositionRangeRate
    from vidtrack.radar.sensors import RangeAzimuth as RangeAzimuth
    from vidtrack.radar.sensors import RangeAzimuthElevation as RangeAzimuthElevation
    from vidtrack.run.radar import track_plots as track_plots
    from vidtrack.run.trackers import box_tracker as box_tracker
    from vidtrack.run.video import track as track
    from vidtrack.scan import Scan as Scan
    from vidtrack.tracking.boxes import box_scan as box_scan
    from vidtrack.tracking.deferred.mht import MHT as MHT
    from vidtrack.tracking.deferred.splitting import Split as Split
    from vidtrack.tracking.formation.groups import Formation as Formation
    from vidtrack.tracking.formation.groups import GroupTracker as GroupTracker
    from vidtrack.tracking.lifecycle import LifeCycle as LifeCycle
    from vidtrack.tracking.log_ratio import LogRatio as LogRatio
    from vidtrack.tracking.occlusion.occlusion import Occlusion as Occlusion
    from vidtrack.tracking.picture.picture import NoPicture as NoPicture
    from vidtrack.tracking.picture.picture import Picture as Picture
    from vidtrack.tracking.rates import Rates as Rates
    from vidtrack.tracking.replay import Replay as Replay
    from vidtrack.tracking.station import Station as Station
    from vidtrack.tracking.tracker import Tracker as Tracker
    from vidtrack.tracks import Status as Status
    from vidtrack.tracks import Tracks as Tracks

_HOME = {
    "ConfigError": "errors",
    "ConstantAcceleration": "estimate.motion.acceleration",
    "ConstantVelocity": "estimate.motion.velocity",
    "CoordinatedTurn": "estimate.motion.turn",
    "Error": "errors",
    "FixedGainBank": "estimate.fixed_gain",
    "FormatError": "errors",
    "Formation": "tracking.formation.groups",
    "GNN": "associate.hard",
    "Gate": "associate.gate",
    "GeneralizedNN": "associate.generalized_nn",
    "GreedyGNN": "associate.hard",
    "GroupTracker": "tracking.formation.groups",
    "IMMBank": "estimate.imm",
    "JPDA": "associate.jpda",
    "KalmanBank": "estimate.kalman",
    "LifeCycle": "tracking.lifecycle",
    "LikelihoodGate": "associate.gate",
    "LogRatio": "tracking.log_ratio",
    "MHT": "tracking.deferred.mht",
    "NN": "associate.hard",
    "NoPicture": "tracking.picture.picture",
    "Occlusion": "tracking.occlusion.occlusion",
    "OutputError": "errors",
    "PDA": "associate.pda",
    "PSN": "associate.strongest",
    "ParticleBank": "estimate.particle",
    "Picture": "tracking.picture.picture",
    "PlotFormatError": "errors",
    "PositionRangeRate": "radar.sensors",
    "RangeAzimuth": "radar.sensors",
    "RangeAzimuthElevation": "radar.sensors",
    "Rates": "tracking.rates",
    "Replay": "tracking.replay",
    "Scan": "scan",
    "ScanError": "errors",
    "Settings": "config.settings",
    "Singer": "estimate.motion.acceleration",
    "SourceError": "errors",
    "Split": "tracking.deferred.splitting",
    "Station": "tracking.station",
    "Status": "tracks",
    "StoppedEarly": "errors",
    "StrongestNeighbour": "associate.strongest",
    "ThresholdController": "amplitude.threshold",
    "Tracker": "tracking.tracker",
    "Tracks": "tracks",
    "UnscentedBank": "estimate.unscented",
    "box_scan": "tracking.boxes",
    "box_tracker": "run.trackers",
    "load_settings": "config.load",
    "track": "run.video",
    "track_plots": "run.radar",
}
__all__ = sorted(_HOME)


def __dir__() -> list[str]:
    """The public names, for completion."""
    return __all__


def __getattr__(name: str) -> Any:
    """The public name, imported from its module in `_HOME`."""
    if name not in _HOME:
        raise AttributeError(f"module vidtrack has no attribute {name}")
    module = import_module(f"vidtrack.{_HOME[name]}")
    value = getattr(module, "load" if name == "load_settings" else name)
    globals()[name] = value
    return value
