"""Scenes for the tests, and the program beside the package."""

import os
import pathlib
import shutil
from typing import Optional

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]

SCENE = b"""#Inventor V2.1 ascii
Separator {
  PerspectiveCamera { position 0 0 5 focalDistance 5 }
  DirectionalLight { direction 0 -1 -1 }
  DEF Red Material { diffuseColor 1 0 0 }
  DEF Ball Sphere { radius 1.5 }
  Separator { Translation { translation 2 0 0 } Cube { width 0.5 } }
}
"""


@pytest.fixture
def scene(tmp_path: pathlib.Path) -> pathlib.Path:
    """A file with a ball and a cube."""
    path = tmp_path / "ball.iv"
    path.write_bytes(SCENE)
    return path


def program() -> Optional[str]:
    """The program `ivcam`: $IVCAM, that of the path, or a build of the repository."""
    built = [ROOT / "target" / kind / "ivcam" for kind in ("release", "debug")]
    names = [os.environ.get("IVCAM"), shutil.which("ivcam"), *map(str, built)]
    return next((name for name in names if name and os.path.exists(name)), None)


@pytest.fixture
def command() -> str:
    """The program; without one the test is skipped."""
    found = program()
    if found is None:
        pytest.skip("there is no program `ivcam`: set IVCAM or build the repository")
    return found
