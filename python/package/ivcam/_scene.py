"""Scenes: documents, their nodes, triangles, conversions and checks of folders."""

from __future__ import annotations

import math
import os
from dataclasses import dataclass
from typing import Any, Dict, Iterator, List, Optional, Sequence, Tuple, Union

import numpy as np
import numpy.typing as npt

from . import _ivcam
from ._common import PathLike, scene_file, warn, warn_texts
from ._ivcam import Node

Record = Dict[str, Any]


@dataclass(frozen=True)
class Triangles:
    """The triangles of a scene in world space. Lengths are in meters.

    Attributes:
        positions: V × 3 float32, the corners.
        normals: V × 3 float32, of length 1, or 0 where there is none.
        uv: V × 2 float32, texture coordinates after the matrix of the texture, v upward.
        colors: V × 4 float32, diffuse color and opacity as a screen shows them, 0 to 1.
        faces: F × 3 uint32, rows of `positions`, counterclockwise as seen from the front.
        material: F uint32, indices of `materials`.
        node: F uint32, indices of `paths`.
        paths: the names of the nodes from the root, with slashes between them.
        materials: dictionaries with `ambient`, `diffuse`, `specular`, `emissive`, `shininess`
            (exponent / 128), `transparency`, `unlit`, `double_sided`, `image` (an index of
            `images`, or `None`), `image_replaces_color`, `image_replaces_opacity` (whether the
            image counts in place of `colors`, and not times them) and `repeat`.
        images: H × W × 4 uint8, rows from the top.
        offset: the point of the world that became the origin of `positions`; 0 unless the scene
            is far from its own origin.
        lines, points: the numbers of line segments and points, which are not triangles and not
            in the arrays.
        problems: what is wrong with the scene.
    """

    positions: npt.NDArray[np.float32]
    normals: npt.NDArray[np.float32]
    uv: npt.NDArray[np.float32]
    colors: npt.NDArray[np.float32]
    faces: npt.NDArray[np.uint32]
    material: npt.NDArray[np.uint32]
    node: npt.NDArray[np.uint32]
    paths: List[str]
    materials: List[Record]
    images: List[npt.NDArray[np.uint8]]
    offset: Tuple[float, float, float]
    lines: int
    points: int
    problems: List[Record]

    def __repr__(self) -> str:
        return (
            f"<ivcam.Triangles: {len(self.faces)} triangles, {len(self.positions)} corners, "
            f"{len(self.materials)} materials>"
        )


@dataclass(frozen=True)
class Conversion:
    """What `Document.convert` wrote.

    Attributes:
        format: the name of the format.
        files: the files that were written, the main one first.
        losses: what the format could not express: dictionaries with `feature`, `text`, `node`,
            `name`, `file`, `line`, `count`, and `stated`, which is false for a default of the file's
            language.
        problems: what is wrong with the scene.
        empty: whether nothing is drawn.
    """

    format: str
    files: List[str]
    losses: List[Record]
    problems: List[Record]
    empty: bool


class Document:
    """A scene that was read. Make one with `ivcam.open`."""

    def __init__(self, core: _ivcam.Document) -> None:
        self._core = core

    @property
    def path(self) -> Optional[str]:
        """The file, or `None` for a scene from bytes."""
        path = self._core.path
        return None if path is None else os.fspath(path)

    @property
    def format(self) -> str:
        """The words of the first line after `#`, such as `Inventor V2.1 ascii`."""
        return self._core.format

    @property
    def nodes(self) -> List[Node]:
        """Every node below the roots, each once, in the order of the file."""
        return self._core.nodes()

    @property
    def roots(self) -> List[Node]:
        """The nodes at the top of the file."""
        return self._core.roots()

    @property
    def problems(self) -> List[Record]:
        """What is wrong with the file: dictionaries with `severity`, `message`, `help`, `file`,
        `line`, `column` (from 1), `byte` (from 0, in binary files) and `count`."""
        return self._core.problems()

    @property
    def cameras(self) -> List[Record]:
        """The cameras and viewpoints in world space at time 0: see `cameras_at`."""
        return self.cameras_at(0.0)

    @property
    def lights(self) -> List[Record]:
        """The lights that are on, in world space at time 0: see `lights_at`."""
        return self.lights_at(0.0)

    def cameras_at(self, time: float) -> List[Record]:
        """Returns the cameras at a time in seconds: `class`, `name`, `line`, `position` (m),
        `orientation` (quaternion x, y, z, w), `near`, `far`, `focal_distance` (m), and
        `height_angle` (rad) or `height` (m)."""
        return self._core.cameras(_time(time))

    def lights_at(self, time: float) -> List[Record]:
        """Returns the lights at a time in seconds: `class`, `name`, `line`, `color`, `intensity`,
        and as the light has them `position` (m), `direction`, `attenuation`, `radius` (m),
        `inner_angle` and `outer_angle` (rad)."""
        return self._core.lights(_time(time))

    def find(self, class_name: str) -> Iterator[Node]:
        """Yields the nodes of a class."""
        return (node for node in self.nodes if node.class_name == class_name)

    def triangles(
        self, *, time: float = 0.0, tolerance: float = 0.005, recenter: bool = True
    ) -> Triangles:
        """Returns what the scene draws as triangles in world space.

        Args:
            time: seconds since the scene was opened.
            tolerance: the largest distance of a triangle from a round surface, as a fraction of
                its radius, from 0.0001 to 0.1.
            recenter: whether a scene that is more than 1000 times its size from the origin is
                moved to it; `offset` then says by how much.

        Raises:
            LimitError: the scene needs more memory or work than one scene may take.
            ValueError: a `time` that is not finite, or a `tolerance` out of its range.
        """
        found = self._core.triangles(_time(time), _tolerance(tolerance), recenter)
        triangles = Triangles(**found)
        left_out = triangles.lines + triangles.points
        if left_out:
            text = f"{triangles.lines} lines and {triangles.points} points are not triangles"
            warn([{"message": text, "file": self.path}])
        return triangles

    def convert(
        self,
        path: PathLike,
        *,
        format: Optional[str] = None,
        time: float = 0.0,
        tolerance: float = 0.005,
        recenter: bool = True,
        animate: Optional[float] = None,
    ) -> Conversion:
        """Writes the scene for another program, by the ending of the name or by `format`: see
        `ivcam.formats()`.

        Args:
            animate: the seconds of motion that are sampled; `None` for those of the scene's
                clocks, 0 for none.

        Raises:
            UnsupportedError: the format is unknown.
            FileError: a file cannot be written.
            ArgumentError: the output is a file of the scene.
            ValueError: `time` or `animate` is not finite, or `tolerance` is out of its range.
        """
        if animate is not None and not 0.0 <= animate < math.inf:
            raise ValueError(f"`animate` is a number of seconds from 0, not {animate}")
        path = os.fspath(path)
        found = self._core.convert(
            path, format, _time(time), _tolerance(tolerance), recenter, animate
        )
        found["files"] = [os.fspath(file) for file in found["files"]]
        return Conversion(**found)

    def to_bytes(self, *, binary: bool = False) -> bytes:
        """Returns the scene in the language of its file, with the fields that were set, and warns
        of what cannot be written: files that the scene names and instances of protos stay as they
        are, so fields that were set in them are left out."""
        data, left_out = self._core.write(binary)
        warn_texts(left_out, 3)
        return data

    def __repr__(self) -> str:
        return f"<ivcam.Document {self.path or 'of bytes'}: {self.format}>"


def _time(seconds: float) -> float:
    seconds = float(seconds)
    if not math.isfinite(seconds):
        raise ValueError(f"`time` is a number of seconds, not {seconds}")
    return seconds


def _tolerance(share: float) -> float:
    share = float(share)
    if not 0.0001 <= share <= 0.1:
        raise ValueError(f"`tolerance` is from 0.0001 to 0.1, not {share}")
    return share


def open(
    source: Union[PathLike, bytes, bytearray, memoryview],
    *,
    name: str = "scene",
    folder: Optional[PathLike] = None,
    search: Sequence[PathLike] = (),
    contain: Optional[PathLike] = None,
) -> Document:
    """Reads a scene: Open Inventor, VRML 1.0, VRML97, X3D, glTF, OBJ, PLY or STL, plain or gzipped.

    What is wrong with the file and was skipped is in `problems` of the result, and no warning.

    Args:
        source: a path, or the bytes of a file.
        name: for bytes, the name of the file in messages.
        folder: for bytes, the folder whose files the scene may name; without one it opens none.
        search: more folders that are searched for files of the scene.
        contain: the folder below which the scene's files must be [the scene's project].

    Raises:
        NotFoundError, FileError: the file is not there, or cannot be read.
        SceneSyntaxError, DamagedError, ...: it is no scene. All are `IvcamError`.
    """
    folders = [os.fspath(path) for path in search]
    if isinstance(source, (bytes, bytearray, memoryview)):
        if contain is not None:
            raise TypeError("`contain` is for a path; give bytes a `folder`")
        below = None if folder is None else os.fspath(folder)
        return Document(_ivcam.Document.from_bytes(bytes(source), name, below, folders))
    if folder is not None:
        raise TypeError("`folder` is for bytes; a path has its own")
    below = None if contain is None else os.fspath(contain)
    return Document(_ivcam.Document.open(scene_file(source), folders, below))


def check(
    *paths: PathLike, search: Sequence[PathLike] = (), contain: Optional[PathLike] = None
) -> List[Record]:
    """Checks scene files and all scene files below folders, as `ivcam check --json` does.

    Returns:
        a dictionary for each file, for `pandas.DataFrame`: `file`, `state` (`whole`, `damaged` or
        `unreadable`), `format`, `nodes`, `classes`, `missing`, `outside`, `diagnostics`, `bounds`
        (m), `triangles`, `lights`, `camera`, …; an unreadable file has the first two and
        `diagnostics`.

    Raises:
        NotFoundError: a folder has no scene file.
    """
    below = None if contain is None else os.fspath(contain)
    if not paths:
        raise TypeError("check() needs a file or a folder")
    names = [scene_file(path) for path in paths]
    records, skipped = _ivcam.check(names, [os.fspath(path) for path in search], below)
    warn(skipped)
    return records


def formats() -> Dict[str, List[str]]:
    """Returns the formats of `Document.convert`, each with the endings of its files."""
    return dict(_ivcam.formats())
