"""Comparison of pictures: measures, alignment, and the camera of an archival picture."""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import Any, Callable, Dict, List, NamedTuple, Optional, Tuple, Union

import numpy as np
import numpy.typing as npt

from . import _ivcam
from ._common import PathLike, checked_call, scene_file, warn
from ._picture import Picture
from ._scene import Document

AnyPicture = Union[PathLike, Picture, npt.NDArray[Any]]


class Frame(NamedTuple):
    """A rectangle of pixels of a picture."""

    left: int
    top: int
    width: int
    height: int


class Alternative(NamedTuple):
    """Another place where an old picture agrees as well."""

    scale: float
    rotation: float
    mirrored: bool


@dataclass(frozen=True)
class Alignment:
    """Where an old picture lies on a new one. `align` makes it.

    Attributes:
        shift: x (right) and y (down) of the old picture's center from the new one's center, in
            pixels of the new one.
        scale: pixels of the new picture in one of the old.
        rotation: the clockwise rotation of the old picture that aligns it, in degrees.
        mirrored: whether the old picture is mirrored, left to right, before it is rotated.
        shift_error, scale_error, rotation_error: standard errors.
        agreement: the correlation of local contrast where the two overlap, on small pictures.
        chance: an upper bound on the probability that an unrelated picture agrees as well.
        photograph: the pixels of the old picture within its border of paper, mat or scanner bed;
            `None` if it is used whole.
        alternatives: other places where it agrees as well; the one that changes it least was taken.
        picture: H × W × 3 float32, the old picture on the new one's pixels; 0 to 1 for levels.
        mask: H × W bool, the pixels that the old picture covers.
    """

    shift: Tuple[float, float]
    scale: float
    rotation: float
    mirrored: bool
    shift_error: float
    scale_error: float
    rotation_error: float
    agreement: float
    chance: float
    photograph: Optional[Frame]
    alternatives: Tuple[Alternative, ...]
    picture: npt.NDArray[np.float32]
    mask: npt.NDArray[np.bool_]


class FitProgress(NamedTuple):
    """How far a fit is."""

    #: The share of the expected work that is done, from 0 to 1.
    share: float
    #: The residual of local contrast of the best camera so far.
    residual: float


@dataclass(frozen=True)
class Fit:
    """The camera that `fit` found. Errors are standard errors, with a focus and an f-number that the
    picture does not determine anywhere in their intervals, and `None` if they are not known. If the
    fit ended early they include what was left to go.

    Attributes:
        position: x, y, z in meters.
        orientation: quaternion x, y, z, w.
        height_angle: the vertical angle of view in radians, for an image at the focal length.
        efl, efl_error, start_efl: the focal length, its error and that of the start, in mm.
        focus, focus_error, start_focus: the focus distance, its error and that of the start, in
            meters. The error is `None` too if the focus was not fitted, or if the range reaches
            infinity.
        focus_range: the nearest and the farthest focus within one standard error, in meters, the
            farthest `None` for infinity; `None` if the focus was not fitted or its error is not known.
        undetermined: what the picture does not determine, of `focus` and `f_number`.
        f_number, f_number_error: the f-number and its error; `None` if it was not fitted.
        distortion, distortion_error: the radial distortion of a pinhole, OpenCV's k1 and k2, and the
            error of k1; `None` if it was not fitted.
        moved, moved_error: the distance from the start's position, in meters.
        turned, turned_error: the angle from the start's orientation, in radians.
        residual: the robust root mean square of the residuals of local contrast, or `None`.
        chance: an upper bound on the probability that a picture of something else agrees as well.
        renders: the number of renderings.
        ended_early: whether the time ended before the fit had converged.
        file: the camera as a file for `camera`, with the options of the lens in a comment.
        picture: H × W × 3 float32, the levels of the rendering of the found camera.
        comparison: `picture` compared with the given one, as `compare` returns it.
        problems: the warnings about the scene and the lens, as dictionaries.
    """

    position: Tuple[float, float, float]
    orientation: Tuple[float, float, float, float]
    height_angle: float
    efl: float
    efl_error: Optional[float]
    start_efl: float
    focus: float
    focus_error: Optional[float]
    focus_range: Optional[Tuple[float, Optional[float]]]
    undetermined: List[str]
    start_focus: float
    f_number: Optional[float]
    f_number_error: Optional[float]
    distortion: Optional[Tuple[float, float]]
    distortion_error: Optional[float]
    moved: float
    moved_error: Optional[float]
    turned: float
    turned_error: Optional[float]
    residual: Optional[float]
    chance: float
    renders: int
    ended_early: bool
    file: str
    picture: npt.NDArray[np.float32]
    comparison: Dict[str, Any]
    problems: List[Dict[str, Any]]

    def save(self, path: PathLike) -> None:
        """Writes the camera file, for `ivcam.render(scene, camera=path, …)`."""
        with open(path, "w", encoding="utf-8") as file:
            file.write(self.file)


def compare(
    new: AnyPicture,
    old: AnyPicture,
    *,
    registration: str = "none",
    match: str = "picture",
    mask: Optional[npt.ArrayLike] = None,
    pixels_per_degree: Optional[float] = None,
) -> Dict[str, Any]:
    """Compares a new picture with an old one, as `ivcam compare --json` does.

    Args:
        new, old: files, pictures, or arrays of H × W or H × W × 1 to 4: uint8 or uint16 levels, or
            floats of which 1 is white. A `Picture` counts with its levels, as its PNG file has them; give
            `picture.pixels` to compare exposures, as EXR files have them. An array of floats is linear
            light for FLIP if the other picture is, as .exr and .hdr files are, and levels otherwise.
        registration: `none` (the sizes are equal), `resize`, or `align` (shift, scale, rotation).
        match: which tone curves are fitted to the old picture: one for the `picture`, one for each
            `channel`, or `none`.
        mask: H × W bool, the pixels of the new picture that count [all].
        pixels_per_degree: the viewing resolution, for FLIP [67.02].

    Returns:
        `width`, `height`, `pixels`, `alignment`, `tones`, and `measures` with `mse`, `psnr` (dB,
        `None` for equal pictures), `ssim`, `flip`, `edges`, `unmatched_mse`, `unmatched_psnr`.

    Raises:
        ValueError: a wrong shape or choice, or a value that is not finite.
        ArgumentError, UnsupportedError, …: all are `IvcamError`.
    """
    if registration not in ("none", "resize", "align"):
        raise ValueError(f"`registration` is none, resize or align, not `{registration}`")
    if match not in ("picture", "channel", "none"):
        raise ValueError(f"`match` is picture, channel or none, not `{match}`")
    if pixels_per_degree is not None and not 1 <= pixels_per_degree <= 1000:
        raise ValueError("`pixels_per_degree` is from 1 to 1000")
    pair = (_plate("new", new), _plate("old", old))
    found, problems = _ivcam.compare(
        *pair, registration, match, pixels_per_degree, _mask(mask), False
    )
    warn(problems)
    return found


def align(new: AnyPicture, old: AnyPicture) -> Alignment:
    """Finds the shift, scale (half to double), rotation (any) and mirroring of an old picture on a
    new one. The pictures are as for `compare`.

    Raises:
        ArgumentError: the pictures agree no better than unrelated ones may, or one is flat.
        ValueError: a wrong shape, or a value that is not finite.
    """
    pair = (_plate("new", new), _plate("old", old))
    found, problems = _ivcam.compare(*pair, "align", "none", None, None, True)
    warn(problems)
    place = dict(found["alignment"])
    place["shift"] = tuple(place["shift"])
    place["photograph"] = place["photograph"] and Frame(**place["photograph"])
    place["alternatives"] = tuple(Alternative(**a) for a in place["alternatives"])
    return Alignment(**place, picture=found["old"], mask=found["mask"])


def fit(
    scene: Union[PathLike, Document],
    picture: AnyPicture,
    *,
    fit_aperture: bool = False,
    progress: Optional[Callable[[FitProgress], object]] = None,
    **options: Any,
) -> Fit:
    """Finds the camera of a picture of a scene, as `ivcam compare --fit` does: position,
    orientation, focal length and focus. The scene is rendered many times, which takes minutes.

    Args:
        scene: a path or a document.
        picture: the picture, as for `compare`. It has to be the whole frame.
        fit_aperture: whether the f-number of the lens is fitted too, from what is out of focus.
        progress: a function that is called with `FitProgress`. An exception of it ends the fit.
        **options: the options of `render` that say where to begin, and the size and samples of
            the renderings: `camera` (a file; begin within centimeters and degrees), `lens`, `efl`
            (mm), `focus` (m), `size`, `samples`, `time` (of the whole fit), … Those of outputs are
            refused.

    Raises:
        TypeError: an option is unknown; the message has the nearest name.
        ArgumentError: an option has a wrong value, the aspects of picture and `size` differ, or a
            picture of something else agrees as well with the found camera.
        UnsupportedError: `solids` or a `region`.
        NotFoundError, FocusError, LimitError, …: all are `IvcamError`.
    """
    checked_call(progress)
    core = scene._core if isinstance(scene, Document) else scene_file(scene)
    call = None if progress is None else _adapted(progress)
    found = _ivcam.fit(core, _plate("picture", picture), fit_aperture, options, call)
    camera = dict(found["camera"])
    for name in ("position", "orientation"):
        camera[name] = tuple(camera[name])
    for name in ("distortion", "focus_range"):
        camera[name] = camera[name] and tuple(camera[name])
    result = Fit(
        **camera,
        picture=found["rendering"],
        comparison=found["comparison"],
        problems=found["problems"],
    )
    warn(result.problems)
    return result


def _adapted(call: Callable[[FitProgress], object]) -> Callable[[float, float], object]:
    return lambda share, residual: call(FitProgress(share, residual))


def _mask(mask: Optional[npt.ArrayLike]) -> Optional[npt.NDArray[np.bool_]]:
    if mask is None:
        return None
    array = np.ascontiguousarray(mask, dtype=np.bool_)
    if array.ndim != 2:
        raise ValueError(f"`mask` has the shape {array.shape}, and H × W is wanted")
    return array


def _plate(name: str, picture: Any) -> Any:
    """Returns a picture as the compiled part takes it: a path, or an array with three dimensions."""
    if isinstance(picture, Picture):
        return picture.levels()
    if not isinstance(picture, np.ndarray):
        return os.fspath(picture)
    array = picture[:, :, None] if picture.ndim == 2 else picture
    if array.ndim != 3 or not 1 <= array.shape[2] <= 4 or 0 in array.shape:
        raise ValueError(f"`{name}` has the shape {picture.shape}, and H × W × 1 to 4 is wanted")
    if array.dtype.kind == "u" and array.dtype.itemsize <= 2:
        return np.ascontiguousarray(array, dtype=array.dtype.newbyteorder("="))
    if array.dtype.kind not in "fb":
        raise ValueError(
            f"`{name}` has {array.dtype} values, and uint8, uint16 or floats are wanted"
        )
    levels = np.ascontiguousarray(array, dtype=np.float32)
    if not np.isfinite(levels).all():
        raise ValueError(f"`{name}` has values that are not finite")
    return levels
