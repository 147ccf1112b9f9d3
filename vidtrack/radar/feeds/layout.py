"""Where the items of an ASTERIX record lie, by the tables of libasterix.

The tables are libasterix's; the walk over them is our own, because its parser makes an object of every field.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache, partial
from typing import Any

from vidtrack.errors import ConfigError

Extent = int | Callable[[bytes, int], int]
"""Octets of an item, or the place after an item that begins at a place."""

_PLANS_KEPT = 1024
"""Field specifications whose items are remembered; a radar uses a few, a hostile sender any number."""


class Damaged(ValueError):  # noqa: N818
    """A record that breaks the rules of its category; what follows it in its block cannot be found."""


class Truncated(Damaged):
    """A record that goes on where the octets end, and is sound up to there."""


class Layout:
    """The items of one kind of record, in the order of their bits in the field specification.

    names    of the items, None for a spare bit
    extents  of the items
    """

    def __init__(self, names: list[str | None], extents: list[Extent]) -> None:
        self._items = list(zip(names, extents, strict=True))
        self._plans: dict[bytes, list[tuple[str, Extent]]] = {}

    def places(self, body: bytes, at: int) -> tuple[dict[str, int], int]:
        """Where each item of the record at `at` begins, and where the record ends. Raises Damaged, Truncated."""
        first = at
        try:
            while body[at] & 1:
                at += 1
            at += 1
            places = {}
            for name, extent in self._plan(body[first:at]):
                places[name] = at
                at = at + extent if isinstance(extent, int) else extent(body, at)
        except IndexError:
            raise Truncated from None
        if at > len(body):
            raise Truncated
        if not places:
            raise Damaged
        return places, at

    def _plan(self, specification: bytes) -> list[tuple[str, Extent]]:
        """The items whose bits are set. Raises Damaged if one is spare."""
        plan = self._plans.get(specification)
        if plan is None:
            plan = [self._item(7 * k + bit) for k, octet in enumerate(specification) for bit in _ones(octet)]
            if len(self._plans) < _PLANS_KEPT:
                self._plans[specification] = plan
        return plan

    def _item(self, number: int) -> tuple[str, Extent]:
        name, extent = self._items[number] if number < len(self._items) else (None, 0)
        if name is None:
            raise Damaged
        return name, extent


@cache
def layouts() -> Mapping[int, Mapping[str, Layout]]:
    """Layouts of the newest edition of each category that is read; CAT 001 has two: plot and track.

    Raises ConfigError without libasterix.
    """
    generated = library()
    chosen: dict[int, dict[str, Layout]] = {}
    for category in (1, 2, 21, 34, 48, 62):
        uap = generated.manifest["CATS"][category][-1].cv_uap
        records = getattr(uap, "cv_uaps", None) or {"": uap.cv_record}
        chosen[category] = {name: _layout(record) for name, record in records.items()}
    return chosen


def library() -> Any:
    """The module `asterix.generated` of libasterix. Raises ConfigError if it is not installed."""
    try:
        import asterix.base
        import asterix.generated
    except ImportError:
        raise ConfigError(
            "ASTERIX needs the package libasterix: pip install 'vidtrack[asterix]' (asterix-decoder, which has the "
            "same module name, must not be installed beside it)"
        ) from None
    return asterix.generated


def _layout(record: Any) -> Layout:
    items = [getattr(item, "cv_non_spare", None) for item in record.cv_items_list]
    names = [item and item.cv_name for item in items]
    return Layout(names, [_extent(item.cv_rule) if item else 0 for item in items])


def _extent(rule: Any) -> Extent:
    """The extent of an item by the rule of its variation."""
    from asterix.base import Compound, Element, Explicit, Extended, Group, Repetitive

    kind = getattr(rule, "cv_variation", None) or rule.cv_default_variation  # all cases are of one size
    if issubclass(kind, (Element, Group)):
        return int(kind.cv_bit_size // 8)
    if issubclass(kind, Extended):
        return partial(_extended, 1)
    if issubclass(kind, Explicit):
        return _explicit
    if issubclass(kind, Repetitive):
        bits = kind.cv_variation.cv_bit_size
        if kind.cv_rep_bytes is None:
            return partial(_extended, (bits + 1) // 8)
        return partial(_repeated, kind.cv_rep_bytes, bits // 8)
    if issubclass(kind, Compound):
        items = kind.cv_items_list
        inner = Layout(
            [item and item.cv_name for item in items], [_extent(item.cv_rule) if item else 0 for item in items]
        )
        return lambda body, at: inner.places(body, at)[1]
    raise TypeError(kind)


def _extended(size: int, body: bytes, at: int) -> int:
    """Parts of `size` octets, each with a last bit that says whether another follows."""
    at += size
    while body[at - 1] & 1:
        at += size
    return at


def _explicit(body: bytes, at: int) -> int:
    """One octet with the length of the whole."""
    if not body[at]:
        raise Damaged
    return at + body[at]


def _repeated(counter: int, size: int, body: bytes, at: int) -> int:
    """A counter and so many parts."""
    if at + counter > len(body):
        raise Truncated
    return at + counter + size * int.from_bytes(body[at : at + counter], "big")


def _ones(octet: int) -> list[int]:
    """The bits set in an octet of a field specification, 0 for the first; the last one only says that more follow."""
    return [bit for bit in range(7) if octet & (0x80 >> bit)]
