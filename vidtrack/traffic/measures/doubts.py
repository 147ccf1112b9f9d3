"""What the traffic says about a calibration, in words."""

from __future__ import annotations

from typing import Any, NamedTuple


class Saying(NamedTuple):
    """What was found, and what to do about it; None where the calibration is not contradicted."""

    found: str
    advice: str | None


def sayings(traffic: dict[str, Any]) -> list[Saying]:
    """Of the sizes and of the straight paths of vehicles, as `contradicting` has them."""
    scale, straight = traffic["scale"], traffic["straightness"]
    return [
        Saying("too few vehicles to check the scale by their sizes", None) if scale is None else _of_sizes(scale),
        *(
            [Saying("too few straight paths along one road to check whether they converge or bend", None)]
            if straight is None
            else _of_paths(straight)
        ),
    ]


def against(report: dict[str, Any]) -> list[str]:
    """What contradicts the calibration of a measured site, one line each: itself, the traffic, lengths of sections."""
    return [*report.get("calibration", []), *doubts(report), *report.get("sections", [])]


def doubts(traffic: dict[str, Any]) -> list[str]:
    """What of the traffic contradicts the calibration, one line each."""
    return [f"{saying.found}; {saying.advice}" for saying in sayings(traffic) if saying.advice]


def _of_sizes(scale: dict[str, Any]) -> Saying:
    found = (
        f"vehicles come out {scale['factor']:.2f} times as large as vehicles are (standard deviation "
        f"{scale['sigma']:.2f}, {scale['vehicles']} vehicles)"
    )
    advice = "check the lengths and their unit in the calibration: speeds are off by as much"
    return Saying(found, advice if scale["off"] else None)


def _of_paths(straight: dict[str, Any]) -> list[Saying]:
    lanes = (
        f"straight paths along one road, {straight['apart_m']:.1f} m apart, converge by "
        f"{straight['converging_deg']:.2f} degrees (standard deviation {straight['converging_sigma_deg']:.2f}, "
        f"{straight['paths']} paths)"
    )
    wrong = "if its lanes are parallel, a point of the calibration is wrong: run vidtrack calibrate"
    lens = (
        f"straight paths bend as by a lens that moves the corner of the picture by {straight['lens_px']:.0f} px "
        f"(standard deviation {straight['lens_sigma_px']:.0f})"
    )
    return [
        Saying(lanes, wrong if straight["converges"] else None),
        Saying(lens, "give the calibration the lens's distortion" if straight["bends"] else None),
    ]
