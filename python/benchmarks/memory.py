"""The memory of a process that opens, renders and traces a tiny scene many times.

    python benchmarks/memory.py [--times 10000]

Prints the resident memory after each tenth of the work, in Markdown. Linux only.
"""

import argparse
import os
import time
import warnings

import numpy as np

import ivcam

SCENE = b"""#Inventor V2.1 ascii
PerspectiveCamera { position 0 0 5 }
DirectionalLight { }
Separator { Material { diffuseColor 1 0 0 } DEF Ball Sphere { } }
"""


def resident() -> float:
    """Returns the memory of this process in MiB."""
    with open("/proc/self/statm", encoding="ascii") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 2**20


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--times", type=int, default=10_000)
    times = parser.parse_args().times
    warnings.simplefilter("ignore")
    lens = ivcam.Lens("cooke-triplet")
    origins = np.column_stack([np.zeros((1000, 2)), np.full(1000, -50.0)])
    print("| opens, renders and traces | MiB | seconds |\n|---|---|---|")
    start = time.perf_counter()
    for number in range(times + 1):
        if number % max(1, times // 10) == 0:
            print(
                f"| {number} | {resident():.1f} | {time.perf_counter() - start:.0f} |", flush=True
            )
        scene = ivcam.open(SCENE)
        scene.triangles()
        next(scene.find("Sphere"))["radius"] = 1.5
        ivcam.render(scene, lens="none", size=(4, 4), samples=1, layers=True)
        lens.trace(origins, [0, 0, 1])


if __name__ == "__main__":
    main()
