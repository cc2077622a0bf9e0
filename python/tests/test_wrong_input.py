"""Wrong input is an exception by kind, with its place, and never ends the process."""

import math
import pathlib
import random
from typing import Any, Callable, Dict, List

import numpy as np
import pytest
from conftest import SCENE

import ivcam

NAN, INF = math.nan, math.inf

CASES: List[Callable[[], object]] = [
    lambda: ivcam.open("/no/such/file.iv"),
    lambda: ivcam.open(b""),
    lambda: ivcam.open(b"#VRML V2.0 utf8\n" + b"\x1f\x8b" * 50, folder="/no/such/folder").nodes[1],
    lambda: ivcam.open(SCENE).cameras_at(NAN),
    lambda: ivcam.open(SCENE).lights_at(INF),
    lambda: ivcam.open(SCENE).triangles(tolerance=NAN),
    lambda: ivcam.open(SCENE).triangles(tolerance=0.0),
    lambda: ivcam.open(SCENE).triangles(time=-INF),
    lambda: ivcam.open(SCENE).convert("/no/such/folder/a.glb"),
    lambda: ivcam.open(SCENE).convert("a.glb", format="gbl"),
    lambda: ivcam.open(SCENE).convert("a.glb", animate=-1),
    lambda: ivcam.open(SCENE).roots[0].__setitem__("radius", 1),
    lambda: next(ivcam.open(SCENE).find("Sphere")).__setitem__("radius", [1, 2]),
    lambda: next(ivcam.open(SCENE).find("Material")).__setitem__("diffuseColor", [[1, 2]]),
    lambda: next(ivcam.open(SCENE).find("Sphere"))["radus"],
    lambda: ivcam.check(),
    lambda: ivcam.Lens(""),
    lambda: ivcam.Lens("/dev/null"),
    lambda: ivcam.Lens("double-gauss", wavelength=NAN),
    lambda: ivcam.Lens("double-gauss", efl=0),
    lambda: ivcam.Lens("double-gauss", efl=INF),
    lambda: ivcam.Lens("double-gauss", f_number=-2),
    lambda: ivcam.Lens("double-gauss", focus=NAN),
    lambda: ivcam.Lens("double-gauss", focus=0.001),
    lambda: ivcam.Lens("double-gauss", focus=[1, 2]),
    lambda: ivcam.Lens("double-gauss", coating=object()),
    lambda: ivcam.Lens.from_prescription({}),
    lambda: ivcam.Lens.from_prescription({"surfaces": [{"kind": "sphere", "R": NAN}]}),
    lambda: ivcam.Lens("double-gauss").trace([1, 2], [0, 0, 1]),
    lambda: ivcam.Lens("double-gauss").trace(np.zeros((2, 3)), np.zeros((3, 3))),
    lambda: ivcam.Lens("double-gauss").trace([0, 0, 0], [0, 0, 1], threads=0),
    lambda: ivcam.Lens("double-gauss").trace([0, 0, 0], [0, 0, 1], threads=10**6),
    lambda: ivcam.Lens("double-gauss").trace([0, 0, 0], [0, 0, 1], NAN),
    lambda: ivcam.Lens("double-gauss").trace([0, 0, 0], [0, 0, 1], at_z=NAN),
    lambda: ivcam.Lens("double-gauss").trace([0, 0, 0], [0, 0, 1], out=3),  # type: ignore[arg-type]
    lambda: ivcam.Lens("double-gauss").trace([["0", "0", "0"]], [0, 0, 1]),
    lambda: ivcam.Lens("double-gauss").trace([[None, 0, 0]], [0, 0, 1]),  # type: ignore[list-item]
    lambda: ivcam.Lens("double-gauss").trace([[0, 0, 1j]], [0, 0, 1]),
    lambda: ivcam.Lens("double-gauss").illumination(["1"]),
    lambda: ivcam.Lens("double-gauss").spot(grid=0),
    lambda: ivcam.Lens("double-gauss").irradiance([1, 2, 3]),
    lambda: ivcam.Lens("double-gauss").irradiance([[NAN, 0]]),
    lambda: ivcam.Lens("double-gauss").illumination([NAN, 0]),
    lambda: ivcam.Lens("double-gauss").best_focus(NAN),
    lambda: ivcam.Lens("double-gauss").distortion([[1, 2]]),
    lambda: ivcam.Lens("double-gauss").distortion([1], axis="z"),
    lambda: ivcam.Lens("double-gauss").mtf([-1]),
    lambda: ivcam.Lens("double-gauss").mtf([10], ["70 percent"]),
    lambda: ivcam.Lens("double-gauss").psf([NAN]),
    lambda: ivcam.Lens("double-gauss").psf([0], size=4),
    lambda: ivcam.Lens("double-gauss").psf([0], wavelengths=[]),
    lambda: ivcam.Lens("double-gauss").psf([0], wavelengths={550: -1}),
    lambda: ivcam.Lens("double-gauss").psf([0], film=(0, 24)),
    lambda: ivcam.Lens("double-gauss").psf([0], defocus=NAN),
    lambda: ivcam.Lens("double-gauss").psf([0], defocus=500),
    lambda: ivcam.Lens("double-gauss").export("opncv"),
    lambda: ivcam.Lens("double-gauss").save("/no/such/folder/a.zmx"),
    lambda: ivcam.render("/no/such/file.iv"),
    lambda: ivcam.render(ivcam.open(SCENE), samples=0),
    lambda: ivcam.render(ivcam.open(SCENE), samples=NAN),
    lambda: ivcam.render(ivcam.open(SCENE), size=(0, 10)),
    lambda: ivcam.render(ivcam.open(SCENE), size=(10, 10, 10)),
    lambda: ivcam.render(ivcam.open(SCENE), size=10**9),
    lambda: ivcam.render(ivcam.open(SCENE), size=(10**6, 10**6)),
    lambda: ivcam.render(ivcam.open(SCENE), focus=-1),
    lambda: ivcam.render(ivcam.open(SCENE), shading="gl2"),
    lambda: ivcam.render(ivcam.open(SCENE), lens=3),
    lambda: ivcam.render(ivcam.open(SCENE), threads=10**9),
    lambda: ivcam.render(ivcam.open(SCENE), output="a.xyz"),
    lambda: ivcam.render(ivcam.open(SCENE), size=(2, 2), samples=1, lens="none").levels(300),
    lambda: ivcam.render(ivcam.open(SCENE), sampels=2),
    lambda: ivcam.render(3),  # type: ignore[arg-type]
    lambda: ivcam.render(ivcam.open(SCENE), progress=5),  # type: ignore[arg-type]
    lambda: ivcam.fit(ivcam.open(SCENE), np.eye(40), progress=5),  # type: ignore[arg-type]
    lambda: ivcam.compare(np.zeros((4, 4, 5)), np.zeros((4, 4, 5))),
    lambda: ivcam.compare(np.zeros((0, 4, 3)), np.zeros((0, 4, 3))),
    lambda: ivcam.compare(np.zeros((4, 4, 3), np.int64), np.zeros((4, 4, 3))),
    lambda: ivcam.compare(np.full((9, 9), NAN), np.zeros((9, 9))),
    lambda: ivcam.compare("/dev/null", "/dev/null"),
    lambda: ivcam.compare(np.zeros((9, 9)), np.zeros((9, 9)), mask=np.ones((3, 3))),
    lambda: ivcam.compare(np.zeros((9, 9)), np.zeros((9, 9)), mask=np.zeros((9, 9))),
    lambda: ivcam.compare(np.zeros((9, 9)), np.zeros((9, 9)), pixels_per_degree=NAN),
    lambda: ivcam.align(np.zeros((40, 40)), np.zeros((40, 40))),
    lambda: ivcam.align(np.eye(4), np.eye(4)),
    lambda: ivcam.fit(ivcam.open(SCENE), np.zeros((4, 4, 5))),
    lambda: ivcam.fit(ivcam.open(SCENE), np.zeros((40, 40)), output="a.png"),
    lambda: ivcam.fit(ivcam.open(SCENE), np.zeros((40, 40)), region="0,0,2,2"),
    lambda: ivcam.fit(ivcam.open(SCENE), np.zeros((40, 90)), size=(40, 40), lens="none"),
    lambda: ivcam.fit("/no/such/file.iv", np.zeros((40, 40))),
    lambda: ivcam.fit(ivcam.open(SCENE), np.zeros((40, 40)), fit_aperture=True, lens="none"),
]


@pytest.mark.filterwarnings("ignore::ivcam.IvcamWarning")
@pytest.mark.parametrize("number", range(len(CASES)))
def test_wrong_input_is_an_exception(number: int) -> None:
    kinds = (ivcam.IvcamError, ValueError, TypeError, LookupError)
    with pytest.raises(kinds) as error:
        CASES[number]()
    assert str(error.value)


@pytest.mark.parametrize("value", [NAN, INF, -INF, 1e300, -1e300])
def test_numbers_without_a_place_give_nan_and_no_fault(value: float) -> None:
    lens = ivcam.Lens("double-gauss")
    origins = [[0.0, value, -50.0], [0.0, 0.0, -50.0]]
    rays = lens.trace(origins, [[0.0, 0.0, 1.0], [value, 0.0, 1.0]])
    assert (rays.code[0] != ivcam.PASSED) and np.isnan(rays.at_z(lens.film_z)[0]).all()
    if not math.isnan(value):
        light = lens.irradiance([[value, 0]])
        assert not np.isfinite(light).any() or light == 0
        lens.best_focus(value)
    assert np.isnan(lens.distortion([value])["angle"]).all()
    assert lens.spot(0, value) is None


def test_dead_files_have_their_kind(tmp_path: pathlib.Path) -> None:
    kinds: Dict[str, Any] = {
        "gone.iv": ivcam.NotFoundError,
        "empty.iv": ivcam.IvcamError,
        "text.iv": ivcam.DamagedError,
    }
    (tmp_path / "empty.iv").write_bytes(b"")
    (tmp_path / "text.iv").write_bytes(b"Dear archive,\n")
    for name, kind in kinds.items():
        with pytest.raises(kind) as error:
            ivcam.open(tmp_path / name)
        assert name in str(error.value)


def test_what_can_be_read_of_a_damaged_file_is_read_and_the_rest_reported() -> None:
    document = ivcam.open(b"#Inventor V2.1 binary\n\0\0\0\4Cu", name="cut.iv")
    assert document.problems and document.problems[0]["file"] == "cut.iv"
    (record,) = ivcam.check("/no/such/file.iv")
    assert record["state"] == "unreadable" and record["diagnostics"]


def test_damaged_bytes_never_end_the_process() -> None:
    rng = random.Random(5)
    opened = 0
    for _ in range(400):
        data = bytearray(SCENE)
        for _ in range(rng.randint(1, 12)):
            data[rng.randrange(len(data))] = rng.randrange(256)
        del data[rng.randrange(len(data)) :]
        try:
            document = ivcam.open(bytes(data))
            document.triangles()
            [node.fields for node in document.nodes]
            opened += 1
        except ivcam.IvcamError as error:
            assert error.message
    assert opened > 100
