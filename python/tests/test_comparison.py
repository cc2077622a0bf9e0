"""Comparison, alignment, and the camera of a picture."""

import json
import math
import pathlib
import subprocess
import warnings
from typing import Any, Dict, List

import numpy as np
import pytest

import ivcam

#: A room of boxes, so that a picture shows where its camera stood.
BOXES = b"""#Inventor V2.1 ascii
Separator {
  PerspectiveCamera { position 0.1 0.2 5 focalDistance 5 heightAngle 0.7 }
  DirectionalLight { direction 1 -2 -1.5 }
  Separator { Translation { translation 0 -1.2 0 } Material { diffuseColor 0.5 0.5 0.4 }
    Cube { width 8 height 0.2 depth 8 } }
  Separator { Translation { translation -1.2 -0.4 0.3 } Rotation { rotation 0 1 0 0.5 }
    Material { diffuseColor 0.8 0.2 0.1 } Cube { width 1 height 1.4 depth 1 } }
  Separator { Translation { translation 1 -0.6 1 } Rotation { rotation 0 1 0 1.0 }
    Material { diffuseColor 0.1 0.3 0.8 } Cube { width 0.8 height 1 depth 0.8 } }
  Separator { Translation { translation 0.2 0.2 -2 } Material { diffuseColor 0.2 0.7 0.3 }
    Cube { width 1.4 height 2.8 depth 0.6 } }
}
"""
OPTIONS: Dict[str, Any] = {"lens": "none", "size": (96, 64), "samples": 4}


@pytest.fixture
def boxes(tmp_path: pathlib.Path) -> pathlib.Path:
    path = tmp_path / "boxes.iv"
    path.write_bytes(BOXES)
    return path


def test_arrays_are_compared() -> None:
    rng = np.random.default_rng(2)
    a = rng.uniform(0, 1, (40, 50, 3)).astype(np.float32)
    same = ivcam.compare(a, a)
    assert same["measures"]["mse"] == 0 and same["measures"]["ssim"] == pytest.approx(1)
    other = np.clip(a + 0.1, 0, 1)
    found = ivcam.compare(a, other, match="none")
    expected = np.mean(np.square(a.astype(float) - other.astype(float)))
    assert found["measures"]["mse"] == pytest.approx(expected, rel=1e-6)
    levels = (a * 255).round().astype(np.uint8)
    assert ivcam.compare(levels, levels)["measures"]["mse"] == 0
    wide = (a * 65535).round().astype(np.uint16)
    for order in "<>":
        swapped = wide.astype(f"{order}u2")
        assert ivcam.compare(a, swapped, match="none")["measures"]["mse"] < 1e-10


def test_a_mask_chooses_the_pixels_that_count() -> None:
    rng = np.random.default_rng(3)
    a = rng.uniform(0, 1, (40, 50))
    b = a.copy()
    b[:20] = 1 - b[:20]
    mask = np.zeros((40, 50), bool)
    mask[20:] = True
    found = ivcam.compare(a, b, match="none", mask=mask)
    assert found["pixels"] == 1000 and found["measures"]["mse"] == 0
    assert ivcam.compare(a, b, match="none", mask=~mask)["measures"]["mse"] > 0.05


def test_wrong_pictures_are_refused() -> None:
    a = np.zeros((40, 50, 3), np.float32)
    with pytest.raises(ValueError, match="shape"):
        ivcam.compare(a, np.zeros((3, 4, 5, 6)))
    with pytest.raises(ivcam.ArgumentError, match="50x20"):
        ivcam.compare(a, a[:20])
    with pytest.raises(ValueError, match="finite"):
        ivcam.compare(a, np.full_like(a, np.nan))
    with pytest.raises(ValueError, match="registration"):
        ivcam.compare(a, a, registration="shift")


def test_a_picture_counts_with_the_levels_of_its_file(
    boxes: pathlib.Path, tmp_path: pathlib.Path, command: str
) -> None:
    one = ivcam.render(boxes, **OPTIONS)
    other = ivcam.render(boxes, **OPTIONS, seed=9)
    files = [tmp_path / "one.png", tmp_path / "other.png"]
    one.save(files[0])
    other.save(files[1])
    mine = ivcam.compare(one, other)
    line = [command, "compare", *map(str, files), "--json"]
    printed = json.loads(subprocess.run(line, capture_output=True, check=True).stdout)
    del printed["limits_exceeded"]
    assert mine == ivcam.compare(*files) == printed
    assert ivcam.compare(one, files[0])["measures"]["mse"] == 0


@pytest.mark.filterwarnings("ignore:.*filmic:ivcam.IvcamWarning")
def test_linear_light_is_compared_as_the_program_does(
    boxes: pathlib.Path, tmp_path: pathlib.Path, command: str
) -> None:
    one, other = (ivcam.render(boxes, **OPTIONS, response="filmic", seed=seed) for seed in (1, 2))
    files = [tmp_path / "one.exr", tmp_path / "other.exr"]
    one.save(files[0])
    other.save(files[1])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        mine = ivcam.compare(*files)
        assert mine == ivcam.compare(one.pixels, files[1]) == ivcam.compare(files[0], other.pixels)
        levels = ivcam.compare(one.pixels, other.pixels)
    line = [command, "compare", *map(str, files), "--json"]
    printed = json.loads(subprocess.run(line, capture_output=True, check=True).stdout)
    del printed["limits_exceeded"]
    assert mine == printed and mine["measures"]["flip"] != levels["measures"]["flip"]
    with pytest.warns(ivcam.IvcamWarning, match="one.exr` has linear light, and `old` levels"):
        ivcam.compare(files[0], other)


def test_an_alignment_finds_the_turn_and_shift_of_a_picture(boxes: pathlib.Path) -> None:
    new = ivcam.render(boxes, **{**OPTIONS, "size": (240, 160), "samples": 16}).levels()
    turned = np.rot90(new, axes=(1, 0)).copy()  # Clockwise by 90 degrees.
    found = ivcam.align(new, turned)
    assert found.rotation % 360 == pytest.approx(270, abs=0.01) and not found.mirrored
    assert found.scale == pytest.approx(1, abs=1e-3) and found.chance < 1e-3
    assert found.picture.shape == (160, 240, 3) and found.picture.dtype == np.float32
    assert found.mask.shape == (160, 240) and found.mask.mean() > 0.98
    off = np.abs(found.picture - new / np.float32(255))[found.mask]
    assert off.mean() < 1e-3
    part = ivcam.align(new, new[10:130, 30:230])
    assert part.shift == pytest.approx((10.0, -10.0), abs=0.1)
    assert not part.mask[0].any() and part.mask[70, 120]
    with pytest.raises(ivcam.ArgumentError, match="agree"):
        ivcam.align(new, np.random.default_rng(1).uniform(size=(160, 240)))


@pytest.mark.filterwarnings("ignore::ivcam.IvcamWarning")
def test_a_fit_finds_where_the_camera_stood(boxes: pathlib.Path, tmp_path: pathlib.Path) -> None:
    scene = ivcam.open(boxes)
    truth = ivcam.render(scene, **{**OPTIONS, "samples": 16, "seed": 5})
    camera = next(scene.find("PerspectiveCamera"))
    camera["position"] = [0.13, 0.17, 5.03]
    camera["orientation"] = [0, 1, 0, 0.01]
    seen: List[ivcam.FitProgress] = []
    found = ivcam.fit(scene, truth, progress=seen.append, **OPTIONS)
    assert found.height_angle == pytest.approx(0.7, rel=0.01)
    truly = math.dist([0.13, 0.17, 5.03], [0.1, 0.2, 5])
    assert found.moved_error is not None and 0 < found.moved_error < 0.03
    # Four standard errors are exceeded by chance once in 16,000 runs.
    assert np.linalg.norm(np.subtract(found.position, [0.1, 0.2, 5])) < 4 * found.moved_error
    assert abs(found.moved - truly) < 4 * found.moved_error
    assert found.focus_error is None and found.renders > 10 and not found.ended_early
    assert found.picture.shape == (64, 96, 3)
    assert found.comparison["measures"]["ssim"] > 0.9
    assert seen and seen[-1].share <= 1
    found.save(tmp_path / "found.dat")
    again = ivcam.render(boxes, camera=tmp_path / "found.dat", **{**OPTIONS, "samples": 16})
    assert ivcam.compare(again, truth)["measures"]["ssim"] > 0.9


def test_a_fit_is_ended_by_an_exception(boxes: pathlib.Path) -> None:
    truth = ivcam.render(boxes, **OPTIONS)

    def stop(_: ivcam.FitProgress) -> None:
        raise RuntimeError("enough")

    with pytest.raises(RuntimeError, match="enough"):
        ivcam.fit(boxes, truth, progress=stop, **{**OPTIONS, "samples": 64})


@pytest.mark.filterwarnings("ignore::ivcam.IvcamWarning")
def test_a_fit_is_that_of_the_program(
    boxes: pathlib.Path, tmp_path: pathlib.Path, command: str
) -> None:
    truth = tmp_path / "truth.png"
    ivcam.render(boxes, **OPTIONS, seed=5).save(truth)
    start = tmp_path / "start.iv"
    start.write_bytes(BOXES.replace(b"0.1 0.2 5 ", b"0.12 0.18 5.02 "))
    found = ivcam.fit(start, truth, **OPTIONS)
    line = [command, "compare", str(start), str(truth), "--fit", str(tmp_path / "c.dat")]
    words = ["--lens=none", "--size=96x64", "--samples=4", "--quiet", "--json"]
    printed = subprocess.run([*line, *words], capture_output=True, check=True)
    assert found.file == (tmp_path / "c.dat").read_text()
    theirs = json.loads(printed.stdout)
    del theirs["limits_exceeded"]
    camera = theirs.pop("camera")
    assert found.position == tuple(camera["position"]) and found.efl_error == camera["efl_error"]
    assert found.comparison == theirs


@pytest.mark.filterwarnings("ignore::ivcam.IvcamWarning")
def test_a_fit_of_the_aperture_is_that_of_the_program(
    boxes: pathlib.Path, tmp_path: pathlib.Path, command: str
) -> None:
    lens: Dict[str, Any] = {"lens": "double-gauss", "efl": 50, "size": (96, 64), "samples": 4}
    truth = tmp_path / "truth.png"
    ivcam.render(boxes, **{**lens, "samples": 16}, f_number=4, focus=5, seed=5).save(truth)
    found = ivcam.fit(boxes, truth, fit_aperture=True, **lens, focus=5, f_number=2.8)
    assert found.f_number == pytest.approx(4, rel=0.1)
    line = [command, "compare", str(boxes), str(truth), "--fit", str(tmp_path / "c.dat")]
    words = ["--fit-aperture", "--lens=double-gauss", "--efl=50", "--size=96x64", "--samples=4"]
    rest = ["--focus=5", "--f-number=2.8", "--quiet", "--json"]
    subprocess.run([*line, *words, *rest], capture_output=True, check=True)
    assert found.file == (tmp_path / "c.dat").read_text()
    with pytest.raises(ivcam.IvcamError, match="pinhole"):
        ivcam.fit(boxes, truth, fit_aperture=True, **OPTIONS)
