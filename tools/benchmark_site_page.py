"""Time in which the page of `vidtrack site` gets its counts, on the day of `tools/benchmark_measure.py`.

    python tools/benchmark_site_page.py --vehicles 10000 -o DIR

One gate of four is moved by 3 px at a time, as in a drag; then the calibration is taken away and put back.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from copy import deepcopy
from pathlib import Path

import numpy as np
from benchmark_measure import write_day

from vidtrack.serve.site.draft import Draft
from vidtrack.serve.site.file import SiteFile
from vidtrack.traffic.measures.recount import Recount

STEPS = 20


def seconds(do: Callable[[], object]) -> tuple[float, float]:
    """Time by the clock and of the processor."""
    begin = time.perf_counter(), time.process_time()
    do()
    return time.perf_counter() - begin[0], time.process_time() - begin[1]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--vehicles", type=int, default=10_000)
    parser.add_argument("-o", "--output", type=Path, required=True)
    options = parser.parse_args()
    if not (options.output / "summary.json").exists():
        write_day(options.output, options.vehicles)
    tree, _ = SiteFile(options.output / "site.toml").read()
    assert tree is not None
    draft = Draft(Recount([str(options.output)]))
    draft.look(tree, count=True)  # compiles
    drag = []
    for _ in range(STEPS):
        tree["gates"]["middle"]["line"][0][0] += 3
        drag.append(seconds(lambda: draft.look(tree, count=True)))
    bare = deepcopy(tree)
    del bare["calibration"]
    roads = [seconds(lambda one=one: draft.look(one, count=True)) for one in (bare, tree)]
    paths = seconds(lambda: draft.paths(tree))
    for name, times in (("a step of a drag", drag), ("another road", roads), ("all paths", [paths])):
        clock, processor = np.median(times, axis=0)
        print(f"{name}: {clock:.2f} s, {processor:.2f} s of CPU")


if __name__ == "__main__":
    main()
