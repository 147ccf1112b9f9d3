"""What a run can be told, or a user, about a source."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Advice:
    """One finding in words.

    name     of the trouble
    problem  it hurts; otherwise it is only worth knowing
    text     what was measured, why it hurts, what to do
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
    """--scale for so many source pixels per processed pixel."""
    return f"--scale {1 / step:.3g}"
