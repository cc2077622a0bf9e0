"""Pictures: options by name, progress, interrupts, files."""

import os
import pathlib
import re
import signal
import subprocess
import sys
import threading
import time
from typing import Any, Dict, List

import numpy as np
import pytest

import ivcam

SMALL: Dict[str, Any] = {
    "size": (30, 20),
    "samples": 4,
    "lens": "double-gauss",
    "efl": 50,
    "focus": 5,
}


def test_a_picture_is_an_array_with_its_error(scene: pathlib.Path) -> None:
    picture = ivcam.render(scene, **{**SMALL, "samples": 16})
    assert picture.pixels.shape == (20, 30, 3) and picture.pixels.dtype == np.float32
    assert not picture.pixels.flags.writeable and picture.pixels is picture.pixels
    assert picture.error is not None and picture.interval is not None
    assert picture.interval[0] <= picture.error <= picture.interval[1]
    assert picture.samples == 16 and "30x20" in repr(picture)
    assert picture._repr_png_()[:8] == b"\x89PNG\r\n\x1a\n"
    assert picture.levels().dtype == np.uint8 and picture.levels(16).dtype == np.uint16
    assert picture.metadata["Command"].startswith("ivcam render")
    assert picture.report["total_seconds"] > 0
    with pytest.raises(ValueError, match="layers=True"):
        picture.layers


def test_a_document_is_rendered_as_its_file(scene: pathlib.Path) -> None:
    document = ivcam.open(scene)
    one, other = ivcam.render(scene, **SMALL), ivcam.render(document, **SMALL)
    np.testing.assert_array_equal(one.pixels, other.pixels)
    next(document.find("Sphere"))["radius"] = 0.5
    assert (ivcam.render(document, **SMALL).pixels != one.pixels).any()
    with pytest.raises(ValueError, match="environment"):
        ivcam.render(document, environment="a.env")


def test_threads_do_not_change_a_bit(scene: pathlib.Path) -> None:
    one = ivcam.render(scene, threads=1, **SMALL)
    three = ivcam.render(scene, threads=2, **SMALL)
    np.testing.assert_array_equal(one.pixels, three.pixels)


def test_layers_have_the_depth_of_the_ball(scene: pathlib.Path) -> None:
    picture = ivcam.render(scene, layers=True, lens="none", size=(31, 21), samples=4)
    depth = picture.layers["Z"]
    assert depth.shape == (21, 31)
    assert depth[10, 15] == pytest.approx(3.5, abs=0.05)


def test_files_are_written(scene: pathlib.Path, tmp_path: pathlib.Path) -> None:
    out = tmp_path / "out.png"
    picture = ivcam.render(scene, output=out, report=tmp_path / "r.json", **SMALL)
    assert ivcam.compare(out, out)["measures"]["psnr"] is None
    assert (tmp_path / "r.json").exists()
    again = tmp_path / "again.png"
    picture.save(again)
    assert ivcam.compare(again, out)["measures"]["mse"] == 0
    with pytest.raises(ivcam.UnsupportedError):
        picture.save(tmp_path / "a.xyz")
    with pytest.raises(ivcam.IvcamError):
        picture.save(tmp_path / "no" / "folder" / "a.png")


def test_inputs_are_kept_and_outputs_checked_before_the_render(
    scene: pathlib.Path, tmp_path: pathlib.Path
) -> None:
    (tmp_path / "part.iv").write_bytes(scene.read_bytes())
    whole = tmp_path / "whole.iv"
    whole.write_text('#Inventor V2.1 ascii\nFile { name "part.iv" }\n')
    kept = {path: path.read_bytes() for path in (whole, tmp_path / "part.iv", scene)}
    seen: List[ivcam.Progress] = []
    hours: Dict[str, Any] = {"samples": 65536, "size": (1000, 800), "progress": seen.append}
    for option in ("write_camera", "report"):
        for source in (whole, ivcam.open(whole)):
            for path in (whole, tmp_path / "part.iv"):
                with pytest.raises(ivcam.ArgumentError, match=f"`{option} .*would overwrite"):
                    ivcam.render(source, **hours, **{option: path})
        with pytest.raises(ivcam.ArgumentError, match="would overwrite"):
            ivcam.render(whole, camera=scene, **hours, **{option: scene})
    for option in ("output", "aov", "write_camera", "report"):
        with pytest.raises(ivcam.NotFoundError, match="there is no folder"):
            ivcam.render(whole, **hours, **{option: tmp_path / "no" / "a.exr"})
    with pytest.raises(ivcam.ArgumentError, match="write to the same file"):
        ivcam.render(whole, **hours, output=tmp_path / "a.exr", report=tmp_path / "a.exr")
    assert not seen and kept == {path: path.read_bytes() for path in kept}


def test_wrong_options_are_refused(scene: pathlib.Path) -> None:
    with pytest.raises(TypeError, match="Did you mean `samples`"):
        ivcam.render(scene, sampels=4)
    with pytest.raises(TypeError, match="ivcam render --checkpoint"):
        ivcam.render(scene, checkpoint="a")
    with pytest.raises(TypeError, match="True or False"):
        ivcam.render(scene, adaptive="yes")
    with pytest.raises(ivcam.ArgumentError, match="samples"):
        ivcam.render(scene, samples=-1)
    with pytest.raises(ivcam.NotFoundError):
        ivcam.render(scene, lens="biogn")
    with pytest.raises(ivcam.IvcamError):
        ivcam.render(scene.parent / "gone.iv")
    assert "samples" in {name for name, _, _ in ivcam.render_options()}


def test_progress_is_called_and_may_end_the_render(scene: pathlib.Path) -> None:
    seen: List[ivcam.Progress] = []
    ivcam.render(scene, progress=seen.append, **SMALL)
    assert seen and seen[-1].share == pytest.approx(1)

    def stop(_: ivcam.Progress) -> None:
        raise RuntimeError("enough")

    with pytest.raises(RuntimeError, match="enough"):
        ivcam.render(scene, progress=stop, samples=4096, size=(300, 200))


@pytest.mark.filterwarnings("ignore::ivcam.IvcamWarning")
def test_other_threads_run_during_a_render(scene: pathlib.Path) -> None:
    counted = 0
    done = threading.Event()

    def count() -> None:
        nonlocal counted
        while not done.is_set():
            counted += 1
            time.sleep(0.001)

    thread = threading.Thread(target=count)
    thread.start()
    ivcam.render(scene, size=(200, 150), samples=16, lens="double-gauss", focus=5)
    done.set()
    thread.join()
    assert counted > 10


@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
def test_an_interrupt_ends_the_render(scene: pathlib.Path) -> None:
    timer = threading.Timer(0.5, os.kill, (os.getpid(), signal.SIGINT))
    timer.start()
    start = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        ivcam.render(scene, samples=65536, size=(1000, 800))
    assert time.monotonic() - start < 20


def test_a_bar_shows_the_progress(
    scene: pathlib.Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    ivcam.render(scene, progress=True, **SMALL)
    assert "100%" in capfd.readouterr().err
    monkeypatch.setitem(sys.modules, "tqdm.auto", None)  # As if tqdm were not installed.
    ivcam.render(scene, progress=True, **SMALL)
    assert "render 100%" in capfd.readouterr().err


def test_every_option_of_the_program_is_a_keyword(command: str) -> None:
    printed = subprocess.run([command, "render", "--help"], capture_output=True, text=True)
    words = set(re.findall(r"^ +(?:-\w, )?--([a-z0-9-]+)", printed.stdout, re.MULTILINE))
    names = {name.replace("_", "-") for name, _, _ in ivcam.render_options()}
    of_processes = {
        "checkpoint",
        "denoise",
        "every",
        "layers",
        "progress",
        "quiet",
        "sample-range",
        "tev",
    }
    of_folders = {"force"}
    assert len(words) > 50 and words - names - of_processes - of_folders <= {"help"}


def test_options_are_texts_numbers_paths_and_sequences(scene: pathlib.Path) -> None:
    expected = ivcam.render(scene, **SMALL).pixels
    others: List[Dict[str, Any]] = [
        {**SMALL, "size": "30x20", "samples": "4", "efl": "50mm", "focus": "5m"},
        {**SMALL, "size": [30, 20], "samples": np.int64(4), "efl": np.float32(50), "focus": 5.0},
        {**SMALL, "seed": None, "adaptive": False, "film": (36, 24)},
    ]
    for options in others:
        np.testing.assert_array_equal(ivcam.render(os.fspath(scene), **options).pixels, expected)
