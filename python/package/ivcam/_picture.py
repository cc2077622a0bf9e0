"""Pictures of scenes."""

from __future__ import annotations

import os
from typing import Any, Callable, Dict, List, NamedTuple, Optional, Tuple, Union

import numpy as np
import numpy.typing as npt

from . import _ivcam
from ._common import PathLike, checked_call, scene_file, warn
from ._scene import Document


class Progress(NamedTuple):
    """How far a render is."""

    #: The share of the work that is done, from 0 to 1.
    share: float
    #: The samples that all pixels have.
    samples: int
    #: The relative error so far, if it is known.
    error: Optional[float]


class Picture:
    """A picture in linear exposure values, with its error. `ivcam.render` makes it."""

    def __init__(self, core: _ivcam.Picture) -> None:
        self._core = core
        self._layers: Optional[Dict[str, npt.NDArray[np.float32]]] = None

    @property
    def pixels(self) -> npt.NDArray[np.float32]:
        """H × W × 3 float32, red, green and blue, rows from the top; 1 is white. The array is
        not a copy and cannot be written; `pixels.copy()` can."""
        return self._core.pixels

    @property
    def error(self) -> Optional[float]:
        """The estimated root mean square error over the mean of the picture; `None` if it is
        unknown."""
        return self._core.error

    @property
    def interval(self) -> Optional[Tuple[float, float]]:
        """The 95% confidence interval of `error`."""
        return self._core.interval

    @property
    def samples(self) -> int:
        """The samples of each pixel."""
        return self._core.samples

    @property
    def layers(self) -> Dict[str, npt.NDArray[np.float32]]:
        """The layers by their names in EXR files, each H × W float32: `Z` (depth in meters),
        `P.X` … (position, m), `N.X` … (normal), `albedo.R` …, `error.R` …, `samples.Y`, `lost.Y`.

        Raises:
            ValueError: the picture was rendered without `layers=True`.
        """
        if self._layers is None:
            self._layers = self._core.layers()
        if self._layers is None:
            raise ValueError("the picture has no layers: render it with `layers=True`")
        return self._layers

    @property
    def metadata(self) -> Dict[str, str]:
        """What files of the picture say about it: the command that makes it, and all choices."""
        return self._core.metadata

    @property
    def report(self) -> Dict[str, Any]:
        """What `--report` writes: seconds, rays, error, and what was left out."""
        return self._core.report()

    @property
    def problems(self) -> List[Dict[str, Any]]:
        """The warnings about the scene, the lens and the picture, as dictionaries."""
        return self._core.warnings()

    @property
    def notices(self) -> List[str]:
        """What was chosen for a scene without a light or a camera, and what the lens leaves dark."""
        return self._core.notices

    def levels(self, depth: int = 8) -> npt.NDArray[Any]:
        """Returns H × W × 3 levels after the film's response, uint8 or (depth 16) uint16, as
        PNG files have them."""
        return self._core.levels(depth)

    def save(self, path: PathLike, *, depth: Optional[int] = None) -> None:
        """Writes the picture: .png, .exr, .tif, .jpg, .rgb, .sgi or .ppm, with 8 or 16 bits where
        the format has levels.

        Raises:
            UnsupportedError: the ending is unknown.
            FileError: the file cannot be written. There is none then.
        """
        self._core.save(os.fspath(path), depth)

    def _repr_png_(self) -> bytes:
        return self._core.png()

    def __repr__(self) -> str:
        height, width, _ = self.pixels.shape
        error = "error unknown" if self.error is None else f"error {self.error:.2%}"
        return f"<ivcam.Picture {width}x{height}, {self.samples} samples, {error}>"


def render(
    scene: Union[PathLike, Document],
    *,
    progress: Union[None, bool, Callable[[Progress], object]] = None,
    layers: bool = False,
    **options: Any,
) -> Picture:
    """Photographs a scene through a lens.

    The picture has the bits of `ivcam render` with the same options, at any number of threads.
    Other threads of Python run meanwhile, and Ctrl-C ends the render.

    Args:
        scene: a file, or a document of `ivcam.open` with the fields that were set.
        progress: `True` for a bar (by tqdm if it is installed), or a function that gets a
            `Progress` some twenty times a second. An exception of it ends the render.
        layers: whether the picture gets `layers`.
        **options: every option of `ivcam render` by its name, with underscores: `lens`, `efl`
            (mm), `f_number`, `focus` (m), `samples`, `size=(width, height)`, `shading`,
            `target_error`, `time`, `camera`, `headlight`, `exposure`, `seed`, `threads`,
            `output`, … A switch is `True` or `False`. `ivcam.render_options()` lists all. Those of
            processes (`checkpoint`, `denoise`, `tev`, …) are the command line's alone.

    Raises:
        TypeError: an option is unknown; the message has the nearest name.
        ArgumentError: an option has a wrong value.
        NotFoundError, FocusError, LimitError, …: all are `IvcamError`.

    Warnings about the scene and the picture are `IvcamWarning`, and `problems` of the result.
    """
    if not isinstance(progress, bool):
        checked_call(progress)
    core = scene._core if isinstance(scene, Document) else scene_file(scene)
    shown = _Bar() if progress is True else None
    call = shown.show if shown else progress if callable(progress) else None
    look = None if call is None else _adapted(call)
    try:
        picture = Picture(_ivcam.render(core, options, look, layers))
    finally:
        if shown:
            shown.close()
    warn(picture.problems)
    return picture


def _adapted(
    call: Callable[[Progress], object],
) -> Callable[[int, int, int, Optional[float]], None]:
    def look(done: int, work: int, samples: int, error: Optional[float]) -> None:
        call(Progress(done / work if work else 1.0, samples, error))

    return look


class _Bar:
    """A bar on standard error."""

    def __init__(self) -> None:
        self._tqdm: Any = None
        self._percent = -1
        try:
            from tqdm.auto import tqdm  # type: ignore[import-untyped,unused-ignore]
        except ImportError:
            return
        self._tqdm = tqdm(total=100, unit="%")

    def show(self, progress: Progress) -> None:
        percent = int(100 * progress.share)
        if percent == self._percent:
            return
        if self._tqdm is not None:
            self._tqdm.update(percent - max(self._percent, 0))
        else:
            import sys

            print(f"\rrender {percent}%", end="", file=sys.stderr, flush=True)
        self._percent = percent

    def close(self) -> None:
        if self._tqdm is not None:
            self._tqdm.close()
        elif self._percent >= 0:
            import sys

            print(file=sys.stderr)
