"""The median in a compiled kernel."""

from __future__ import annotations

from vidtrack.arrays.types import Floats
from vidtrack.compiled import inlined, kernel


@kernel
def median(values: Floats) -> float:
    """Median of values (N,), N > 0, without NaN; their order changes. NumPy's takes 2 s to compile."""
    half = len(values) // 2
    upper = ranked(values, half)
    if len(values) % 2:
        return upper
    lower = values[0]
    for k in range(1, half):  # all that are no larger are in front of it now
        lower = max(lower, values[k])
    return (lower + upper) / 2


@inlined
def ranked(values: Floats, rank: int) -> float:
    """The value with so many before it in ascending order, moved to its place, by Hoare's selection."""
    low, high = 0, len(values) - 1
    while low < high:
        pivot = values[(low + high) // 2]
        i, j = low, high
        while i <= j:
            while values[i] < pivot:
                i += 1
            while pivot < values[j]:
                j -= 1
            if i <= j:
                values[i], values[j] = values[j], values[i]
                i, j = i + 1, j - 1
        if rank <= j:
            high = j
        elif rank >= i:
            low = i
        else:
            break
    return values[rank]
