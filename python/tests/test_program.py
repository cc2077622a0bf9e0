"""The package beside the program: the same bits of pictures, the same numbers of lenses."""

import json
import pathlib
import subprocess
from typing import Any, Dict, List

import numpy as np
import pytest
from conftest import ROOT

import ivcam

LENS: Dict[str, Any] = {"lens": "double-gauss", "efl": 50, "focus": 5}
BALL: List[Dict[str, Any]] = [
    {**LENS, "size": (48, 32), "samples": 8},
    {**LENS, "size": (48, 32), "samples": 4, "f_number": 8, "seed": 7},
    {**LENS, "size": (48, 32), "samples": 4, "shading": "path", "headlight": True},
    {"size": (40, 30), "samples": 2, "lens": "none", "shading": "gl"},
    {"size": (40, 30), "samples": 4, "era": "1999", "lens": "fisheye", "focus": 5},
    {"size": (48, 32), "samples": 4, "lens": "cooke-triplet", "f_number": 8, "diffraction": True},
    {"size": (48, 32), "samples": 8, "lens": "biogon", "efl": 21, "adaptive": True},
]
LIVROOM: List[Dict[str, Any]] = [
    {**LENS, "size": (36, 24), "samples": 2, "camera": ROOT / "camera" / "cam-11.dat"},
    {"size": (36, 24), "samples": 2, "lens": "nikkor-16", "focus": 1.25, "exposure": 0.8},
    {"size": (36, 24), "samples": 2, "lens": "none", "shading": "recursive"},
]


def words(options: Dict[str, Any]) -> List[str]:
    """Returns options as words of the command line."""

    switches = {name for name, value, _ in ivcam.render_options() if value == "bool"}

    def word(name: str, value: Any) -> str:
        if name in switches:
            return f"--{name.replace('_', '-')}"
        text = "x".join(map(str, value)) if isinstance(value, tuple) else str(value)
        return f"--{name.replace('_', '-')}={'on' if value is True else text}"

    return [word(name, value) for name, value in options.items()]


@pytest.mark.filterwarnings("ignore::ivcam.IvcamWarning")
@pytest.mark.parametrize(
    ("number", "options"), list(enumerate(BALL + LIVROOM)), ids=lambda v: str(v)[:3]
)
def test_pictures_have_the_bits_of_the_program(
    number: int, options: Dict[str, Any], scene: pathlib.Path, tmp_path: pathlib.Path, command: str
) -> None:
    file = scene if number < len(BALL) else ROOT / "scenes" / "livroom" / "livroom.iv"
    theirs = tmp_path / "program.exr"
    line = [command, "render", str(file), *words(options), "-o", str(theirs), "--quiet"]
    subprocess.run(line, check=True)
    picture = ivcam.render(file, **options)
    mine = tmp_path / "package.exr"
    picture.save(mine)
    assert picture.pixels.max() > 0
    # The measure sums squares of differences in double precision, so 0 is equality of all values.
    assert ivcam.compare(mine, theirs, match="none")["measures"]["mse"] == 0
    # The exposures that the package returns are those that it writes.
    exposures = ivcam.compare(np.asarray(picture.pixels), theirs, match="none")
    assert exposures["measures"]["mse"] == 0


BUTTON = """#VRML V2.0 utf8
NavigationInfo { headlight FALSE }
Viewpoint { position 0 0 6 }
Group { children [
  DEF Button TouchSensor { }
  Shape { appearance Appearance { material Material { diffuseColor 1 0 0 } } geometry Box { } }
] }
DEF Lamp PointLight { location 2 3 5 on FALSE }
DEF Clock TimeSensor { cycleInterval 100 }
ROUTE Button.touchTime TO Clock.set_startTime
ROUTE Clock.isActive TO Lamp.set_on
"""


@pytest.mark.filterwarnings("ignore::ivcam.IvcamWarning")
def test_pointers_and_events_are_those_of_the_program(tmp_path: pathlib.Path, command: str) -> None:
    file = tmp_path / "button.wrl"
    file.write_text(BUTTON)
    options: Dict[str, Any] = {"size": (40, 30), "samples": 1, "lens": "none", "scene_time": 2}
    assert ivcam.render(file, **options).pixels.max() == 0
    pointers: List[Dict[str, Any]] = [{"touch": "Button@1"}, {"event": "Lamp.set_on=TRUE@1"}]
    for more in pointers:
        theirs = tmp_path / "program.exr"
        line = [command, "render", str(file), *words({**options, **more}), "-o", str(theirs)]
        subprocess.run([*line, "--quiet"], check=True)
        lit = ivcam.render(file, **options, **more)
        assert lit.pixels.max() > 0.1
        assert ivcam.compare(lit.pixels, theirs, match="none")["measures"]["mse"] == 0


@pytest.mark.filterwarnings("ignore::ivcam.IvcamWarning")
@pytest.mark.parametrize("name", ivcam.lenses())
def test_numbers_are_those_of_the_program(name: str, command: str) -> None:
    printed = subprocess.run([command, "lens", name, "--json"], capture_output=True, check=True)
    assert ivcam.Lens(name).first_order == json.loads(printed.stdout)


@pytest.mark.filterwarnings("ignore::ivcam.IvcamWarning")
@pytest.mark.parametrize("name", ["biogon", "phone", "nikkor-6", "anamorphic"])
def test_curves_are_those_of_the_program(name: str, command: str) -> None:
    line = [command, "lens", name, "--json", "--curves", "--fields=0,70%"]
    printed = json.loads(subprocess.run(line, capture_output=True, check=True).stdout)
    printed.setdefault("curves", None)
    printed.setdefault("aberrations", None)
    assert ivcam.Lens(name).data(curves=True, fields=[0, "70%"]) == printed


def test_rays_are_those_of_the_program(tmp_path: pathlib.Path, command: str) -> None:
    lens = ivcam.Lens("double-gauss")
    origins = np.column_stack([np.linspace(-60, 60, 9), np.zeros(9), np.full(9, -50.0)])
    rays = lens.trace(origins, [0.0, 0.05, 1.0])
    queries = [{"origin": o.tolist(), "direction": [0.0, 0.05, 1.0]} for o in origins]
    (tmp_path / "rays.json").write_text(json.dumps(queries))
    line = [command, "lens", "double-gauss", "--trace", str(tmp_path / "rays.json")]
    printed = json.loads(subprocess.run(line, capture_output=True, check=True).stdout)
    codes = {"passed": ivcam.PASSED, "missed": ivcam.MISSED, "blocked": ivcam.BLOCKED}
    assert len(printed) == len(origins) and rays.passed.any() and not rays.passed.all()
    for theirs, code, origin, direction in zip(printed, rays.code, rays.origins, rays.directions):
        assert codes[theirs["status"]] == code
        if code == ivcam.PASSED:
            # The program keeps the hits and traces one ray at a time, the package many at once
            # with fused multiplications: the last bits differ.
            np.testing.assert_allclose(origin, theirs["origin"], rtol=0, atol=1e-13)
            np.testing.assert_allclose(direction, theirs["direction"], rtol=0, atol=1e-15)


@pytest.mark.filterwarnings("ignore::ivcam.IvcamWarning")
def test_checks_are_those_of_the_program(command: str) -> None:
    folder = ROOT / "scenes"
    printed = subprocess.run([command, "check", str(folder), "--json"], capture_output=True)
    theirs = [json.loads(line) for line in printed.stdout.splitlines()]
    mine = ivcam.check(folder)
    assert len(mine) == len(theirs) > 10
    for a, b in zip(mine, theirs):
        assert a == b
