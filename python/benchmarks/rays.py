"""Rays per second of ivcam, optiland and rayoptics on one thread, through the same lenses.

    python benchmarks/rays.py [--rays 1000000] [--slow-rays 20000]

The libraries alternate in one run. Each traces the same bundle to the film; their film points are
compared before the times count. rayoptics traces one ray at a time in Python, so it gets
`--slow-rays` of the bundle, and its rate is of those. The times are the least of the rounds. Rates
are those of the processor's time, which does not count what other programs take. Prints a table in
Markdown.
"""

import os

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"):
    os.environ[name] = "1"

import argparse
import platform
import time
import warnings
from importlib.metadata import version
from typing import Dict, List, Tuple

import numpy as np
import peers

import ivcam

LENSES = ["cooke-triplet", "phone"]
ROUNDS = 5
CLOCKS = (time.perf_counter, time.process_time)


def measure(
    name: str, counts: Dict[str, int]
) -> List[Tuple[str, int, Tuple[float, ...], float, float]]:
    """Returns for each library: its name, the rays, the seconds by each clock (the least of the
    rounds), the share of rays that pass, and the largest distance of a film point from ivcam's in
    mm."""
    lens = ivcam.Lens(name)
    origins, directions = peers.bundle(lens, max(counts.values()))
    tracers = peers.tracers(lens)
    points: Dict[str, np.ndarray] = {}
    seconds = {library: (np.inf, np.inf) for library in tracers}
    for tracer in tracers.values():
        tracer(origins[:100], directions[:100])  # Compilation does not count.
    for _ in range(ROUNDS):
        for library, tracer in tracers.items():
            part = slice(counts[library])
            start = [clock() for clock in CLOCKS]
            points[library] = tracer(origins[part], directions[part])
            taken = [clock() - begun for clock, begun in zip(CLOCKS, start)]
            seconds[library] = tuple(map(min, seconds[library], taken))
    rows = []
    for library, found in points.items():
        exact = points["ivcam"][: len(found)]
        lost, lost_exact = np.isnan(found[:, 0]), np.isnan(exact[:, 0])
        differ = int((lost != lost_exact).sum())
        if differ > 1e-4 * len(found):
            raise SystemExit(f"{library}: {differ} of {len(found)} rays are lost by one alone")
        off = float(np.nanmax(np.abs(found - exact)))
        rows.append((library, len(found), seconds[library], 1 - lost.mean(), off))
    return rows


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rays", type=int, default=1_000_000)
    parser.add_argument("--slow-rays", type=int, default=20_000)
    given = parser.parse_args()
    warnings.simplefilter("ignore")
    counts = {library: given.rays for library in peers.BUILDERS}
    counts["rayoptics"] = min(given.slow_rays, given.rays)
    tracers = peers.tracers(ivcam.Lens(LENSES[0]))
    libraries = dict.fromkeys(library.split(",")[0] for library in tracers)
    names = ", ".join(f"{library} {version(library)}" for library in libraries)
    print(f"{names}, numpy {np.__version__}, Python {platform.python_version()}\n")
    print(
        "| lens | library | rays | seconds | of the processor | rays per second "
        "| ivcam is faster by | passed | off by |"
    )
    print("|---|---|---|---|---|---|---|---|---|")
    for name in LENSES:
        rows = measure(name, counts)
        own = rows[0][1] / rows[0][2][1]
        for library, count, (seconds, of_processor), passed, off in rows:
            rate = count / of_processor
            print(
                f"| {name} | {library} | {count:,} | {seconds:.4f} | {of_processor:.4f} "
                f"| {rate:,.0f} | {own / rate:.1f} | {passed:.2%} | {off:.1e} mm |"
            )


if __name__ == "__main__":
    main()
