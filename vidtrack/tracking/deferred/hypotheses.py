"""Sets of hypotheses: which leaves of the track trees are true together, cluster by cluster."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vidtrack.arrays.types import Floats, Ints, Mask
from vidtrack.compiled import kernel


class Hypotheses(NamedTuple):
    """Hypotheses of independent clusters; one hypothesis of each cluster is true.

    first  (C + 1,) cluster c has the hypotheses first[c]..first[c + 1], the likeliest first
    log_p  (H,) ln of their probabilities, which sum to one in each cluster
    start  (H + 1,) hypothesis h consists of the leaves leaf[start[h]..start[h + 1]]
    leaf   (B,) rows of the bank; a row may belong to many hypotheses of one cluster
    """

    first: Ints
    log_p: Floats
    start: Ints
    leaf: Ints

    @classmethod
    def none(cls) -> Hypotheses:
        """No clusters at all."""
        return cls(np.zeros(1, np.int64), np.empty(0), np.zeros(1, np.int64), np.empty(0, np.int64))

    @property
    def cluster(self) -> Ints:
        """(B,) cluster of each entry of `leaf`."""
        size = np.diff(self.start[self.first])
        return np.repeat(np.arange(len(size)), size)

    @property
    def best(self) -> Ints:
        """Leaves of the likeliest hypothesis of every cluster, ascending."""
        return self.leaves(self.first[:-1])

    def leaves(self, hypothesis: Ints) -> Ints:
        """Leaves of these hypotheses (C,), ascending."""
        begin, size = self.start[hypothesis], self.start[hypothesis + 1] - self.start[hypothesis]
        entry = np.arange(size.sum()) + np.repeat(begin - np.cumsum(size) + size, size)
        return np.sort(self.leaf[entry])

    def steady(self, past: Ints, follows: Mask, slack: float) -> Ints:
        """(C,) the hypothesis of each cluster to report: the likeliest, but for the names of its tracks.

        Of hypotheses with the same histories `past` (T, N) of leaves, one all whose leaves follow what was reported
        (T,) comes before a likelier one in which tracks have exchanged them, unless it is less probable by over `slack`
        [ln]. Where the histories of two targets are equally probable for either the report would else go to and fro.
        """
        found = self.first[:-1].copy()
        broken = np.zeros(len(self.log_p), bool)
        broken[np.repeat(np.arange(len(broken)), np.diff(self.start))[~follows[self.leaf]]] = True
        for c in np.flatnonzero(broken[found]):
            best = found[c]
            for h in range(best + 1, self.first[c + 1]):
                if self.log_p[h] < self.log_p[best] - slack:
                    break
                if not broken[h] and self._histories(past, h) == self._histories(past, best):
                    found[c] = h
                    break
        return found

    def _histories(self, past: Ints, hypothesis: int) -> list[list[int]]:
        """Those of its leaves, in a fixed order."""
        return sorted(past[self.leaf[self.start[hypothesis] : self.start[hypothesis + 1]]].tolist())

    def only(self, kept: Mask) -> Hypotheses:
        """The hypotheses of a mask (H,), which holds some of every cluster; probabilities sum to one again."""
        count = np.concatenate([[0], np.cumsum(kept)])
        size = np.diff(self.start)
        start = np.concatenate([[0], np.cumsum(size[kept])])
        first = count[self.first]
        return Hypotheses(first, _normalised(first, self.log_p[kept]), start, self.leaf[np.repeat(kept, size)])

    def marginal(self, label: Ints) -> Hypotheses:
        """Every cluster taken apart by the label (T,) of its leaves, those with label -1 left out.

        Hypotheses that differ in other labels only become one with the sum of their probabilities.
        """
        return Hypotheses(*_marginal(self.first, self.log_p, self.start, self.leaf, label))

    def merged(self, group: Ints, groups: int, most: int, slack: float) -> Hypotheses:
        """Clusters (C,) of one group as one: the product of their hypotheses, `most` likeliest.

        Products less probable than the likeliest by over `slack` [ln] are left out. A group without clusters has
        one hypothesis: nothing is there.
        """
        order = np.argsort(group, kind="stable")
        begin = np.searchsorted(group[order], np.arange(groups + 1))
        return Hypotheses(*_product(self.first, self.log_p, self.start, self.leaf, order, begin, most, slack))


@kernel
def kept(log_p: Floats, threshold: float, most: int, mass: float) -> int:
    """How many of the hypotheses log_p (H,), likeliest first, survive pruning; at least one (SPEC 001, pruning).

    threshold  a less probable one goes; most: no more than so many stay; mass: the likeliest whose probabilities
    sum to this are enough
    """
    p = np.exp(log_p - log_p[0])
    p /= p.sum()
    total, n = 0.0, 0
    while n < min(most, len(p)) and p[n] >= threshold and (mass == 1.0 or total < mass - 1e-12):
        total += p[n]
        n += 1
    return max(1, n)


@kernel
def surviving(first: Ints, log_p: Floats, threshold: float, most: int, mass: float) -> Mask:
    """(H,) hypotheses that survive pruning in their clusters."""
    stays = np.zeros(len(log_p), np.bool_)
    for c in range(len(first) - 1):
        stays[first[c] : first[c] + kept(log_p[first[c] : first[c + 1]], threshold, most, mass)] = True
    return stays


@kernel
def _normalised(first: Ints, log_p: Floats) -> Floats:
    """Logarithms (H,) of probabilities that sum to one in each cluster."""
    out = np.empty(len(log_p))
    for c in range(len(first) - 1):
        a, b = first[c], first[c + 1]
        total = log_sum(log_p[a:b])
        for h in range(a, b):
            out[h] = log_p[h] - total
    return out


@kernel
def log_sum(log_p: Floats) -> float:
    """ln of the sum of exp(log_p)."""
    most = log_p.max()
    return most + np.log(np.exp(log_p - most).sum())


@kernel
def _hash(leaf: int) -> int:
    """A leaf's 64 bits; the sum over a hypothesis tells it from others."""
    bits = (leaf + 1) * 0x2545F4914F6CDD1D
    bits ^= bits >> 29
    bits *= 0x1B03738712FAD5C9
    return bits ^ (bits >> 32)


@kernel
def _marginal(first: Ints, log_p: Floats, start: Ints, leaf: Ints, label: Ints) -> tuple[Ints, Floats, Ints, Ints]:
    slot = np.full(label.max() + 1 if len(label) else 0, -1)
    out_first, out_start = [0], [0]
    out_p, out_leaf = [0.0 for _ in range(0)], [0 for _ in range(0)]  # empty, of a type the compiler knows
    for c in range(len(first) - 1):
        parts = [0 for _ in range(0)]
        for b in range(start[first[c]], start[first[c + 1]]):
            part = label[leaf[b]]
            if part >= 0 and slot[part] < 0:
                slot[part] = len(parts)
                parts.append(part)
        count = first[c + 1] - first[c]
        name = np.zeros((len(parts), count), np.int64)
        for i in range(count):
            h = first[c] + i
            for b in range(start[h], start[h + 1]):
                if label[leaf[b]] >= 0:
                    name[slot[label[leaf[b]]], i] += _hash(leaf[b])
        for s in range(len(parts)):
            order = np.argsort(name[s], kind="mergesort")
            speaker, total = [0 for _ in range(0)], [0.0 for _ in range(0)]  # one for all with the same leaves
            for o in range(count):
                i = order[o]
                p = log_p[first[c] + i]
                if o and name[s, i] == name[s, order[o - 1]]:
                    total[-1] = np.logaddexp(total[-1], p)
                else:
                    speaker.append(i)
                    total.append(p)
            weight = np.array(total)
            weight -= log_sum(weight)
            for o in np.argsort(-weight, kind="mergesort"):
                h = first[c] + speaker[o]
                out_p.append(weight[o])
                for b in range(start[h], start[h + 1]):
                    if label[leaf[b]] == parts[s]:
                        out_leaf.append(leaf[b])
                out_start.append(len(out_leaf))
            out_first.append(len(out_p))
        for part in parts:
            slot[part] = -1
    return np.array(out_first), np.array(out_p), np.array(out_start), np.array(out_leaf)


@kernel
def _product(
    first: Ints, log_p: Floats, start: Ints, leaf: Ints, order: Ints, begin: Ints, most: int, slack: float
) -> tuple[Ints, Floats, Ints, Ints]:
    """The hypotheses of groups begin[g]..begin[g + 1] of the clusters in `order`."""
    out_first, out_start = [0], [0]
    out_p, out_leaf = [0.0 for _ in range(0)], [0 for _ in range(0)]  # empty, of a type the compiler knows
    for g in range(len(begin) - 1):
        members = order[begin[g] : begin[g + 1]]
        weight = np.zeros(1)
        chosen, came = np.empty((len(members), most), np.int64), np.empty((len(members), most), np.int64)
        for d in range(len(members)):
            a, b = first[members[d]], first[members[d] + 1]
            sums, left, right = [0.0 for _ in range(0)], [0 for _ in range(0)], [0 for _ in range(0)]
            for i in range(len(weight)):  # both lists fall: the pair (i, j) has (i + 1)(j + 1) - 1 before it
                for j in range(min(b - a, most // (i + 1))):
                    total = weight[i] + log_p[a + j]
                    if total >= weight[0] + log_p[a] - slack:
                        sums.append(total)
                        left.append(i)
                        right.append(a + j)
            falling = np.argsort(-np.array(sums), kind="mergesort")[:most]
            weight = np.array(sums)[falling]
            for i in range(len(falling)):
                came[d, i], chosen[d, i] = left[falling[i]], right[falling[i]]
        weight -= log_sum(weight)
        for i in range(len(weight)):
            k = i
            for d in range(len(members) - 1, -1, -1):
                h = chosen[d, k]
                k = came[d, k]
                for e in range(start[h], start[h + 1]):
                    out_leaf.append(leaf[e])
            out_p.append(weight[i])
            out_start.append(len(out_leaf))
        out_first.append(len(out_p))
    return np.array(out_first), np.array(out_p), np.array(out_start), np.array(out_leaf)
