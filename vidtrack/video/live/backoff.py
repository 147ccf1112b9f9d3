"""Exponential backoff with jitter between connection attempts."""

from __future__ import annotations

from random import Random

JITTER = 0.2


class Backoff:
    """1, 2, 4, ... times `base_s`, at most `longest_s`, each varied by up to 20 %."""

    def __init__(self, base_s: float, longest_s: float, random: Random) -> None:
        self._base_s = base_s
        self._longest_s = longest_s
        self._random = random
        self._attempts = 0

    def reset(self) -> None:
        """Begin with `base_s` again."""
        self._attempts = 0

    def next_s(self) -> float:
        """Seconds to wait now."""
        wait_s = min(self._base_s * 2.0 ** min(self._attempts, 30), self._longest_s)
        self._attempts += 1
        return wait_s * self._random.uniform(1 - JITTER, 1 + JITTER)
