"""Lenses beside the program and beside closed forms."""

import json
import math
import pathlib
import subprocess

import numpy as np
import pytest

import ivcam


def test_options_are_those_of_the_program(command: str) -> None:
    words = ["biogon", "--efl", "50", "--f-number", "8", "--focus", "1.5", "--json"]
    printed = subprocess.run([command, "lens", *words], capture_output=True, check=True)
    lens = ivcam.Lens("biogon", efl=50, f_number=8, focus=1.5)
    assert lens.first_order == json.loads(printed.stdout)


def test_the_focal_length_is_in_millimeters() -> None:
    lens = ivcam.Lens("biogon", efl=50)
    assert lens.efl == pytest.approx(50, abs=1e-9)
    assert "biogon" in repr(lens)


def test_rays_near_the_axis_meet_at_the_focal_point() -> None:
    lens = ivcam.Lens("double-gauss")
    heights = np.linspace(-0.01, 0.01, 9)
    origins = np.column_stack([np.zeros(9), heights, np.full(9, -50.0)])
    rays = lens.trace(origins, [0.0, 0.0, 2.0])
    assert rays.passed.all() and (rays.surface == -1).all()
    np.testing.assert_allclose(np.linalg.norm(rays.directions, axis=1), 1, atol=1e-14)
    np.testing.assert_allclose(rays.at_z(lens.film_z), 0, atol=1e-6)


def test_lost_rays_have_their_code_and_surface() -> None:
    lens = ivcam.Lens("double-gauss")
    rays = lens.trace(np.array([[0, 0, -50], [0, 500, -50], [0, np.nan, -50]]), [0, 0, 1])
    assert rays.code[0] == ivcam.PASSED
    assert rays.code[1] in (ivcam.MISSED, ivcam.BLOCKED) and rays.surface[1] == 0
    assert rays.code[2] == ivcam.MISSED
    assert np.isnan(rays.origins[1:]).all() and np.isfinite(rays.origins[0]).all()


def test_threads_and_blocks_do_not_change_a_bit() -> None:
    lens = ivcam.Lens("double-gauss")
    rng = np.random.default_rng(1)
    origins = rng.uniform(-30, 30, (10_001, 3))
    origins[:, 2] = -40
    one = lens.trace(origins, [0.01, 0.02, 1], 486.1)
    three = lens.trace(origins, [0.01, 0.02, 1], 486.1, threads=3)
    for a, b in zip(vars(one).values(), vars(three).values()):
        np.testing.assert_array_equal(a, b)
    assert 0 < one.passed.sum() < len(origins)


def test_rays_return_on_their_way() -> None:
    lens = ivcam.Lens("double-gauss")
    out = lens.trace([0, 3, -50], [0, 0.01, 1])
    back = lens.trace(out.origins, -out.directions, toward="scene")
    np.testing.assert_allclose(back.directions[0], -np.array([0, 0.01, 1]) / math.hypot(0.01, 1))


def test_rays_end_on_a_plane_when_asked() -> None:
    lens = ivcam.Lens("double-gauss")
    rng = np.random.default_rng(4)
    origins = np.column_stack([rng.uniform(-30, 30, (1001, 2)), np.full(1001, -40.0)])
    rays = lens.trace(origins, [0.01, 0.02, 1])
    ends = lens.trace(origins, [0.01, 0.02, 1], at_z=lens.film_z)
    assert 0 < rays.passed.sum() < 1001
    np.testing.assert_array_equal(ends.code, rays.code)
    np.testing.assert_array_equal(ends.directions, rays.directions)
    np.testing.assert_allclose(ends.origins[:, :2], rays.at_z(lens.film_z), rtol=0, atol=1e-13)
    assert (ends.origins[ends.passed, 2] == lens.film_z).all()
    assert np.isnan(ends.origins[~ends.passed]).all()
    with pytest.raises(ValueError, match="at_z"):
        lens.trace(origins, [0, 0, 1], at_z=math.inf)


def test_arrays_of_an_earlier_call_are_filled_again() -> None:
    lens = ivcam.Lens("double-gauss")
    origins = np.column_stack([np.linspace(-30, 30, 101), np.zeros(101), np.full(101, -40.0)])
    kept = lens.trace(origins, [0, 0, 1])
    expected = lens.trace(origins, [0, 0.1, 1])
    assert (kept.code != expected.code).any()
    assert lens.trace(origins, [0, 0.1, 1], out=kept) is kept
    for a, b in zip(vars(kept).values(), vars(expected).values()):
        np.testing.assert_array_equal(a, b)
    with pytest.raises(ValueError, match="out.origins"):
        lens.trace(origins[:100], [0, 0, 1], out=kept)
    with pytest.raises(ValueError, match="also an array of the rays"):
        lens.trace(kept.origins, [0, 0, 1], out=kept)
    twice = ivcam.Rays(kept.origins, kept.origins, kept.code, kept.surface)
    with pytest.raises(ValueError, match="`out.origins` and `out.directions` share memory"):
        lens.trace(origins, [0, 0, 1], out=twice)
    kept.directions.flags.writeable = False
    with pytest.raises(ValueError, match="may not be written"):
        lens.trace(origins, [0, 0, 1], out=kept)


def test_wrong_arrays_are_refused() -> None:
    lens = ivcam.Lens("double-gauss")
    with pytest.raises(ValueError, match="N × 3"):
        lens.trace([[0, 0]], [[0, 0, 1]])
    with pytest.raises(ValueError, match="2 origins"):
        lens.trace(np.zeros((2, 3)), np.ones((3, 3)))
    with pytest.raises(TypeError, match="real numbers"):
        lens.trace(["a", "b", "c"], [0, 0, 1])
    with pytest.raises(ValueError, match="nm"):
        lens.trace([0, 0, -1], [0, 0, 1], 5)
    with pytest.raises(ValueError, match="toward"):
        lens.trace([0, 0, -1], [0, 0, 1], toward="back")
    assert len(lens.trace(np.zeros((0, 3)), np.zeros((0, 3))).code) == 0


def test_wrong_names_have_the_nearest_one() -> None:
    with pytest.raises(ivcam.NotFoundError) as error:
        ivcam.Lens("biogn")
    assert "biogon" in str(error.value)
    with pytest.raises(TypeError, match="f_number"):
        ivcam.Lens("biogon", f_numbr=8)
    with pytest.raises(ivcam.ArgumentError, match="efl"):
        ivcam.Lens("biogon", efl=-3)
    with pytest.raises(ValueError, match="NaN"):
        ivcam.Lens("biogon", efl=float("nan"))
    with pytest.raises(ivcam.IvcamError):
        ivcam.Lens("biogon", focus=0.01)
    with pytest.raises(TypeError, match="conditions"):
        ivcam.Lens("biogon").data(feilds=[0])


def test_analysis_agrees_with_the_data_sheet() -> None:
    lens = ivcam.Lens("double-gauss")
    sheet = lens.data(curves=True)["curves"]
    mtf = lens.mtf([5, 10, 20], ["0%", "100%"])
    assert mtf.tangential.shape == mtf.sagittal.shape == (2, 3)
    assert (np.diff(mtf.sagittal[0]) < 0).all() and mtf.heights[0] == 0
    row = sheet["fields"][20]
    focused = ivcam.Lens("double-gauss", focus="inf", focus_method="best")
    found = focused.illumination([0, row["height"]])
    assert found[0] == 1 and found[1] == pytest.approx(row["relative_illumination"], rel=1e-2)
    angle = focused.distortion([row["height"]])["angle"][0]
    assert math.degrees(angle) == pytest.approx(row["angle_degrees"], rel=1e-2)
    spot = lens.spot()
    assert spot is not None and spot.points.shape[1] == 2 and spot.best_rms <= spot.rms


def test_a_prescription_can_be_changed() -> None:
    lens = ivcam.Lens("double-gauss")
    same = ivcam.Lens.from_prescription(lens.prescription())
    assert same.efl == pytest.approx(lens.efl, rel=1e-12)
    changed = lens.prescription()
    changed["surfaces"][0]["R"] *= 1.05
    assert abs(ivcam.Lens.from_prescription(changed).efl - lens.efl) > 0.1


def test_arrays_are_taken_where_lists_are() -> None:
    lens = ivcam.Lens("cooke-triplet", f_number=16)
    heights, nm = np.array([0.0, 5.0]), np.array([550.0])
    images = lens.psf(heights, wavelengths=nm, size=16).images
    np.testing.assert_array_equal(images, lens.psf([0, 5], wavelengths=[550], size=16).images)
    films = [lens.psf([0], size=16, film=film).pitch for film in (43, np.int64(43), np.float32(43))]
    assert films[0] == films[1] == films[2]
    found = lens.mtf(np.array([10, 20]), heights).tangential
    np.testing.assert_array_equal(found, lens.mtf([10, 20], [0, 5]).tangential)
    changed = lens.prescription()
    for surface in changed["surfaces"]:
        surface["R"] = np.float32(surface["R"])
    assert ivcam.Lens.from_prescription(changed).efl == pytest.approx(lens.efl, rel=1e-5)
    changed["surfaces"][0]["R"] = 1j
    with pytest.raises(TypeError, match="complex"):
        ivcam.Lens.from_prescription(changed)


def test_exports_and_drawings_are_made(tmp_path: pathlib.Path) -> None:
    lens = ivcam.Lens("biogon", efl=50)
    assert lens._repr_svg_().startswith("<")
    opencv = lens.export("opencv", film=(36, 24), size=(1920, 1280))
    assert "1920" in opencv
    lens.save(tmp_path / "biogon.zmx")
    assert ivcam.Lens(tmp_path / "biogon.zmx").efl == pytest.approx(50, rel=1e-6)
    with pytest.raises(ivcam.IvcamError):
        lens.export("opncv")


def test_a_lens_is_the_one_that_was_read(
    tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    ivcam.Lens("biogon", wavelength=500).save("mine.zmx")
    lens, same = ivcam.Lens("mine.zmx"), ivcam.Lens("mine.zmx", focus=2.0)
    assert lens.wavelength == pytest.approx(500) == lens.first_order["wavelength_nm"]
    expected = lens.data(curves=True)
    before = ivcam.Lens("mine.zmx", focus=2.0).first_order
    ivcam.Lens("cooke-triplet", efl=20).save("mine.zmx")
    assert lens.data(curves=True) == expected and same.first_order == before
    pathlib.Path("mine.zmx").unlink()
    (tmp_path / "below").mkdir()
    monkeypatch.chdir("below")
    assert lens.fans() == expected["aberrations"]["points"]
    assert lens.film_z == pytest.approx(lens.first_order["rear_focal_point"], abs=1e-9)
    assert lens.export("json") == lens.export("json") and "Biogon" in repr(lens)
    lens.save("again.json")
    assert ivcam.Lens("again.json").efl == pytest.approx(lens.efl, rel=1e-12)


def test_all_lenses_open() -> None:
    names = ivcam.lenses()
    assert len(names) > 20 and "biogon" in names
    assert {name for name, _, _ in ivcam.lens_options()} >= {"efl", "aperture", "focus"}


def test_images_of_points_are_those_that_the_program_draws(tmp_path: pathlib.Path) -> None:
    lens = ivcam.Lens("cooke-triplet", f_number=8)
    lens.save_psf(tmp_path / "drawn.exr")
    spread = lens.psf()
    side, gap = 160, 4
    assert spread.images.shape == (4, side, side, 3) and len(spread.heights) == 4
    drawn = np.zeros((side, 4 * (side + gap) - gap, 3), np.float32)
    for number, image in enumerate(spread.images):
        left = number * (side + gap)
        drawn[:, left : left + side] = image[:, ::-1]  # The image on the film is upside down.
    same = ivcam.compare(drawn, tmp_path / "drawn.exr", match="none")
    assert same["measures"]["mse"] == 0


def test_an_image_of_a_point_is_airys() -> None:
    number = 22
    lens = ivcam.Lens("cooke-triplet", f_number=number, focus="inf")
    spread = lens.psf([0], wavelengths=[550], size=256)
    (image,) = spread.images
    assert image.shape == (256, 256)
    # Most of the light is within the square, which has five Airy radii to each side.
    assert 0.95 < image.sum() * spread.pitch**2 < 1.0
    middle = (np.arange(256) - 127.5) * spread.pitch
    radius = np.hypot(*np.meshgrid(middle, middle))
    airy = 1.22 * 550e-6 * number
    within = image[radius < airy].sum() / image.sum()
    assert within == pytest.approx(0.838, abs=0.03)  # Of all light; a little less than all is here.
    rings = [
        image[np.abs(radius - r) < spread.pitch].mean() for r in airy * np.linspace(0.6, 1.4, 81)
    ]
    assert 0.6 + 0.01 * int(np.argmin(rings)) == pytest.approx(1.0, abs=0.03)


def test_weights_of_wavelengths_mix_their_images() -> None:
    lens = ivcam.Lens("cooke-triplet", f_number=16)
    one, other, mixed = (
        lens.psf([0, "70%"], wavelengths=waves, size=32, film=40)
        for waves in ({500: 1, 650: 0}, {500: 0, 650: 1}, {500: 1, 650: 3})
    )
    assert mixed.heights[1] == pytest.approx(0.7 * 20)
    assert one.pitch == mixed.pitch
    np.testing.assert_allclose(mixed.images, 0.25 * one.images + 0.75 * other.images, rtol=1e-6)
