"""A scene, a lens, and a photograph of the scene through the lens.

python tour.py scenes/livroom/livroom.iv livroom.png
"""

import sys
import time

import numpy as np

import ivcam


def main(scene_file: str, picture_file: str) -> None:
    scene = ivcam.open(scene_file)
    mesh = scene.triangles()
    print(f"{scene.format}: {len(scene.nodes)} nodes, {len(mesh.faces)} triangles")
    for problem in scene.problems:
        print(f"  line {problem['line']}: {problem['message']}")

    lens = ivcam.Lens("double-gauss", efl=60)
    print(f"{lens.name}: {lens.efl:.2f} mm f/{lens.f_number:.2f}")
    rng = np.random.default_rng(0)
    origins = np.column_stack([rng.uniform(-10, 10, (1_000_000, 2)), np.full(1_000_000, -50.0)])
    start = time.perf_counter()
    rays = lens.trace(origins, [0.0, 0.0, 1.0])
    seconds = time.perf_counter() - start
    print(f"{len(origins) / seconds:.3g} rays per second, {rays.passed.mean():.1%} pass")

    picture = ivcam.render(
        scene, lens="double-gauss", efl=60, focus=3.6, size=(180, 120), samples=16, progress=True
    )
    picture.save(picture_file)
    print(picture)


if __name__ == "__main__":
    main(*sys.argv[1:])
