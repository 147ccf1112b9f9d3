"""Advice about a source: problem, explanation and options."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Advice:
    """One piece of advice.

    name     of the finding
    problem  whether it degrades tracking; otherwise it is information
    text     measurement, effect and remedy
    options  of the command line that help
    """

    name: str
    problem: bool
    text: str
    options: tuple[str, ...] = ()


def set_option(name: str, value: float | bool) -> str:
    """--set NAME=VALUE."""
    shown = str(value).lower() if isinstance(value, bool) else f"{value:g}"
    return f"--set {name}={shown}"


def scale_option(step: int) -> str:
    """--scale for `step` source pixels per processed pixel."""
    return f"--scale {1 / step:.3g}"
