"""Memory, threads, forks, and the end of the interpreter."""

import os
import pathlib
import subprocess
import sys
import textwrap
import threading
from typing import Any, Callable, Dict, List

import numpy as np
import pytest
from conftest import SCENE

import ivcam

TINY: Dict[str, Any] = {"size": (4, 4), "samples": 1, "lens": "none", "threads": 1}
LINUX = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="needs /proc and fork")


def resident() -> int:
    """Returns the memory of this process in bytes."""
    with open("/proc/self/statm", encoding="ascii") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")


def growth(work: Callable[[], object], times: int) -> int:
    """Returns by how many bytes this process grows while it works, after as much work before."""
    for _ in range(times):
        work()
    before = resident()
    for _ in range(times):
        work()
    return resident() - before


def run(code: str, scene: pathlib.Path, seconds: float = 60) -> "subprocess.CompletedProcess[str]":
    """Runs code of Python, with the file of a scene, in a new process."""
    words = [sys.executable, "-c", textwrap.dedent(code), str(scene)]
    return subprocess.run(words, capture_output=True, text=True, timeout=seconds)


@LINUX
def test_scenes_lenses_and_arrays_do_not_leave_memory() -> None:
    lens = ivcam.Lens("double-gauss")
    origins = np.column_stack([np.zeros((1000, 2)), np.full(1000, -50.0)])

    def work() -> None:
        document = ivcam.open(SCENE)
        ball = next(document.find("Sphere"))
        ball["radius"] = 2.0
        assert len(document.triangles().faces) > 100 and len(ball.fields) == 1
        assert lens.trace(origins, [0, 0, 1]).passed.all()

    # One scene's arrays are about 100 kB, so one that is kept would make 100 MB.
    assert growth(work, 1000) < 8 << 20


@LINUX
def test_renders_do_not_leave_memory() -> None:
    document = ivcam.open(SCENE)

    def work() -> None:
        picture = ivcam.render(document, progress=lambda _: None, layers=True, **TINY)
        assert picture.pixels.shape == (4, 4, 3) and picture.report and picture.layers

    assert growth(work, 500) < 8 << 20


def test_references_to_objects_are_given_back() -> None:
    document = ivcam.open(SCENE)
    options = dict(TINY)
    calls: List[ivcam.Progress] = []
    marks = (document, options, calls, calls.append)
    before = [sys.getrefcount(mark) for mark in marks]
    for _ in range(50):
        ivcam.render(document, progress=calls.append, **options)
        document.nodes
    assert [sys.getrefcount(mark) for mark in marks] == before


def test_threads_render_one_document_at_once() -> None:
    document = ivcam.open(SCENE)
    options = {**TINY, "size": (30, 20), "samples": 4}
    expected = ivcam.render(document, **options).pixels
    found: List[Any] = []

    def work() -> None:
        for _ in range(5):
            found.append(ivcam.render(document, **options).pixels)
            document.triangles()
            [node.fields for node in document.nodes]

    threads = [threading.Thread(target=work) for _ in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(found) == 40
    for pixels in found:
        np.testing.assert_array_equal(pixels, expected)


def test_code_that_runs_while_problems_are_read_may_set_a_field(scene: pathlib.Path) -> None:
    code = """
        import gc, ivcam
        wrong = " ".join(f"Sphere {{ wrong{i} 1 }}" for i in range(3000))
        document = ivcam.open(f"#Inventor V2.1 ascii\\nCube {{ }} {wrong}".encode())
        cube = document.roots[0]
        class Cycle:
            def __init__(self):
                self.itself = self
            def __del__(self):
                cube["width"] = 3
        gc.set_threshold(10)
        for _ in range(5):
            Cycle()
            assert len(document.problems) == 3000
    """
    assert run(code, scene).returncode == 0


def test_a_field_is_set_while_threads_share_the_work_of_a_large_mesh(scene: pathlib.Path) -> None:
    code = """
        import ivcam, threading
        points = ", ".join(f"{i} {j} {i * j % 7}" for i in range(200) for j in range(200))
        faces = ", ".join(f"{i}, {i + 1}, {i + 201}, {i + 200}, -1" for i in range(39799))
        document = ivcam.open(f"#Inventor V2.1 ascii\\nSphere {{ }} ShapeHints {{ creaseAngle 1 }}"
            f"Coordinate3 {{ point [ {points} ] }} IndexedFaceSet {{ coordIndex [ {faces} ] }}".encode())
        def read():
            for _ in range(3):
                document.triangles()
        threads = [threading.Thread(target=read, daemon=True) for _ in range(8)]
        for thread in threads:
            thread.start()
        while any(thread.is_alive() for thread in threads):
            document.roots[0]["radius"] = 2.0
    """
    # A lock that is held on the shared pool stops a few runs of ten for ever.
    assert run(code, scene).returncode == 0


def test_a_field_is_set_while_other_threads_read() -> None:
    document = ivcam.open(SCENE)
    ball = next(document.find("Sphere"))
    counts: List[int] = []

    def read() -> None:
        for _ in range(30):
            counts.append(len(document.triangles().faces))

    threads = [threading.Thread(target=read) for _ in range(3)]
    for thread in threads:
        thread.start()
    for number in range(300):
        ball["radius"] = 1.0 + 0.001 * number
        assert ball["radius"] == pytest.approx(1.0 + 0.001 * number)
    for thread in threads:
        thread.join()
    assert len(counts) == 90 and min(counts) > 100


@LINUX
def test_a_forked_process_computes_the_same(scene: pathlib.Path) -> None:
    done = run(
        """
        import multiprocessing, sys, warnings
        import numpy as np, ivcam

        warnings.simplefilter("ignore")
        OPTIONS = {"size": (30, 20), "samples": 4, "lens": "double-gauss", "focus": 5}
        document = ivcam.open(sys.argv[1])

        def everything(_=None):
            picture = ivcam.render(document, **OPTIONS).pixels
            other = np.asarray(picture)[::-1].copy()
            ssim = ivcam.compare(picture.copy(), other)["measures"]["ssim"]
            lens = ivcam.Lens("cooke-triplet", f_number=11)
            psf = lens.psf([0], wavelengths=[550], size=16).images
            return picture.copy(), ssim, psf, len(document.triangles().faces)

        mine = everything()          # The pool of the parent has threads now.
        with multiprocessing.get_context("fork").Pool(2) as pool:
            for theirs in pool.map(everything, range(4)):
                for a, b in zip(mine, theirs):
                    np.testing.assert_array_equal(a, b)
        everything()
        print("equal")
        """,
        scene,
    )
    assert (done.returncode, done.stdout.strip()) == (0, "equal"), done.stderr


@pytest.mark.parametrize("work", ["render", "fit", "mtf"])
def test_the_interpreter_ends_during_work_of_a_daemon(work: str, scene: pathlib.Path) -> None:
    done = run(
        f"""
        import sys, threading, time, warnings
        import numpy as np, ivcam

        warnings.simplefilter("ignore")
        begun = threading.Event()

        def render():
            ivcam.render(sys.argv[1], size=(1000, 800), samples=65536,
                         progress=lambda _: begun.set())

        def fit():
            picture = ivcam.render(sys.argv[1], lens="none", size=(96, 64), samples=4)
            begun.set()
            ivcam.fit(sys.argv[1], picture, lens="none", size=(96, 64), samples=256)

        def mtf():
            lens = ivcam.Lens("double-gauss")
            begun.set()
            while True:
                lens.mtf([10, 20], [0, 10])

        threading.Thread(target={work}, daemon=True).start()
        begun.wait(30)
        time.sleep(0.2)
        print("ending")
        """,
        scene,
    )
    assert (done.returncode, done.stdout.strip()) == (0, "ending"), done.stderr
    assert "panicked" not in done.stderr and "FATAL" not in done.stderr.upper()


def test_a_call_after_the_end_is_an_exception(scene: pathlib.Path) -> None:
    done = run(
        """
        import atexit, sys

        def late():
            try:
                ivcam.render(sys.argv[1], size=(4, 4), samples=1)
            except RuntimeError as error:
                print(error)

        atexit.register(late)        # Runs after what was registered later.
        import ivcam
        """,
        scene,
    )
    assert (done.returncode, done.stdout.strip()) == (0, "the interpreter is ending"), done.stderr
