"""Lenses: first order, rays, spots, modulation, light on the film, exports."""

from __future__ import annotations

import itertools
import json
import math
import os
import tempfile
from dataclasses import dataclass
from typing import Any, Dict, List, Mapping, Optional, Sequence, Tuple, Union

import numpy as np
import numpy.typing as npt

from . import _ivcam
from ._common import Array, PathLike, numbers, rows, warn, warn_texts

Numbers = Union[Sequence[float], npt.NDArray[Any]]
Fields = Union[Sequence[Union[float, str]], npt.NDArray[Any]]

#: The codes of `Rays.code`: what became of a ray.
PASSED, MISSED, BLOCKED, TOTAL_REFLECTION = 0, 1, 2, 3


@dataclass(frozen=True)
class Rays:
    """Rays as they leave a lens, in lens space.

    Attributes:
        origins: N × 3, points of the rays in millimeters; NaN for a lost ray.
        directions: N × 3, of length 1; NaN for a lost ray.
        code: N uint8, `PASSED` 0, `MISSED` 1 (the ray missed a surface), `BLOCKED` 2 (it hit a
            surface outside its aperture) or `TOTAL_REFLECTION` 3.
        surface: N int32, the surface where the ray was lost, from 0 at the front with the stop
            counted; -1 for a ray that passed.
    """

    origins: Array
    directions: Array
    code: npt.NDArray[np.uint8]
    surface: npt.NDArray[np.int32]

    @property
    def passed(self) -> npt.NDArray[np.bool_]:
        """N bool: whether each ray passed."""
        passed: npt.NDArray[np.bool_] = self.code == PASSED
        return passed

    def at_z(self, z: float) -> Array:
        """Returns N × 2 points in millimeters where the rays cross a plane; NaN if lost."""
        points = np.empty((len(self.origins), 2))
        # The parts fit into the cache of a processor, which takes a third of the time.
        for start in range(0, len(points), 8192):
            part = slice(start, start + 8192)
            origins, directions = self.origins[part], self.directions[part]
            step = (z - origins[:, 2]) / directions[:, 2]
            for axis in (0, 1):
                points[part, axis] = origins[:, axis] + step * directions[:, axis]
        return points


@dataclass(frozen=True)
class Spot:
    """The spot of a distant point. Lengths are in millimeters.

    Attributes:
        points: N × 2, where the rays hit the film.
        centroid: the mean of the points.
        rms: the root mean square distance from the centroid.
        largest: the largest distance from the centroid.
        beam_area: the cross-section of the beam, mm².
        best_shift: the shift of the film away from the lens for the smallest `rms`.
        best_rms: the smallest `rms`.
    """

    points: Array
    centroid: List[float]
    rms: float
    largest: float
    beam_area: float
    best_shift: float
    best_rms: float


@dataclass(frozen=True)
class Modulation:
    """The modulation transfer of a lens.

    Attributes:
        frequencies: N, line pairs per millimeter.
        heights: F, on the film in millimeters.
        tangential, sagittal: F × N, from 0 to 1.
    """

    frequencies: Array
    heights: Array
    tangential: Array
    sagittal: Array


@dataclass(frozen=True)
class PointSpread:
    """The images of points on the film, by diffraction.

    Attributes:
        images: F × S × S × 3 in white light (linear sRGB), or F × S × S for stated wavelengths: the
            light per mm² of film from a point of light 1. Rows have rising y, and the pixels of a
            row rising x in lens space; the image of the point is in the middle.
        heights: F, the heights of the image points on the film's y axis in millimeters. A point that
            gets no light has no image.
        pitch: the side of a pixel in millimeters, equal for all images.
    """

    images: Array
    heights: Array
    pitch: float


class Lens:
    """A lens with a prescription: one that comes with the package (`ivcam.lenses()`), or a file
    (.dat, .zmx, .seq, .json, …).

    The file is read once, here. Lens space is in millimeters: light travels toward +z, the front vertex is the origin.

    Args:
        name: the name of a lens, or the path of a file.
        wavelength: nanometers [the primary one of the file, or the d line, 587.5618].
        **options: the options of `ivcam lens` by their names: `efl` (mm), `f_number`, `focus` (m
            from the front vertex, or `inf`), `zoom` (a factor), `zoom_position`, `coating`,
            `focus_method`, `glass_catalogue`, `gap`. `ivcam.lens_options()` lists them.

    Raises:
        NotFoundError: there is no such lens.
        TypeError: an option is unknown; the message has the nearest name.
        ArgumentError, FocusError, …: all are `IvcamError`.
    """

    def __init__(
        self, name: PathLike, *, wavelength: Optional[float] = None, **options: Any
    ) -> None:
        checked = None if wavelength is None else _wavelength(wavelength)
        self._core = _ivcam.Lens(os.fspath(name), options, checked)
        self._data: Optional[Dict[str, Any]] = None
        warn(self._core.problems())

    @classmethod
    def from_prescription(
        cls, prescription: Mapping[str, Any], *, wavelength: Optional[float] = None, **options: Any
    ) -> Lens:
        """Makes a lens of a prescription as `prescription` returns it, changed or not.

        A surface has `kind`, `R` (mm; 0 is a plane), `t` (mm to the next surface), `n_d`, `V_d`
        and `semi_diameter` (mm). Where `n_d` or `V_d` is changed, delete `cauchy` or `glass`.
        Numbers and arrays of NumPy count as those of Python.
        """
        with tempfile.TemporaryDirectory(prefix="ivcam-") as folder:
            name = str(prescription.get("name", "lens")).replace(os.sep, "-")
            path = os.path.join(folder, f"{name}.json")
            with open(path, "w", encoding="utf-8") as file:
                json.dump(dict(prescription), file, default=_plain)
            return cls(path, wavelength=wavelength, **options)

    @property
    def name(self) -> str:
        """The name of the lens."""
        return self._core.name

    @property
    def wavelength(self) -> float:
        """The wavelength in nanometers."""
        return self._core.wavelength

    @property
    def film_z(self) -> float:
        """The z of the film in millimeters: at the focus, or at the focal point without one; NaN
        for an afocal lens."""
        z = self._core.film_z
        return math.nan if z is None else z

    @property
    def first_order(self) -> Dict[str, Any]:
        """What `ivcam lens --json` prints: `efl`, `bfl`, `ffl`, focal points and principal planes
        (mm), pupils, `matrix`, `f_number`, `t_number`, `transmittance`, `focus`, `surfaces`, …"""
        if self._data is None:
            self._data = self._json("--json")
        return self._data

    @property
    def efl(self) -> float:
        """The focal length in millimeters; NaN for an afocal lens."""
        return _number(self.first_order["efl"])

    @property
    def f_number(self) -> float:
        """The f-number by real rays; NaN for an afocal lens."""
        return _number(self.first_order["f_number"])

    @property
    def surfaces(self) -> List[Dict[str, Any]]:
        """The surfaces, for a table: `kind`, `radius`, `thickness`, `semi_diameter` (mm), `n_d`,
        `V_d`, `glass`, `stop` and `coating`. For one that can be changed see `prescription`."""
        surfaces: List[Dict[str, Any]] = self.first_order["surfaces"]
        return surfaces

    def prescription(self) -> Dict[str, Any]:
        """Returns the prescription as data that can be changed and given to
        `Lens.from_prescription`; its `surfaces` are a list of dictionaries."""
        text, left_out = self._core.prescription()
        warn_texts([f"the prescription leaves out {what}" for what in left_out])
        data: Dict[str, Any] = json.loads(text)
        return data

    def trace(
        self,
        origins: npt.ArrayLike,
        directions: npt.ArrayLike,
        wavelength: Optional[float] = None,
        *,
        toward: str = "film",
        at_z: Optional[float] = None,
        threads: int = 1,
        out: Optional[Rays] = None,
    ) -> Rays:
        """Traces rays through the lens.

        Args:
            origins: N × 3 or 3, millimeters.
            directions: N × 3 or 3, of any length. One row goes with all of the other array.
            wavelength: nanometers, from 100 to 100,000 [that of the lens].
            toward: `film` or `scene`.
            at_z: the z of a plane in millimeters; `origins` of the result are where rays cross it
                [they are on the last surface].
            threads: the number of threads, from 1 to 1024. Other threads of Python run meanwhile.
            out: the result of an earlier call with as many rays, which is overwritten and returned.
                That saves the time to get memory [a new one].

        A ray with a coordinate that is not finite is lost, with the code `MISSED`.

        Raises:
            ValueError: a wrong shape, wavelength, `toward`, `at_z` or number of threads, or the arrays
                of `out` have another shape or type, cannot be written, or share memory.
            TypeError: an array without numbers, or `out` is no `Rays`.
        """
        start, along = rows("origins", origins, 3), rows("directions", directions, 3)
        if len(start) != len(along) and 1 not in (len(start), len(along)):
            raise ValueError(f"{len(start)} origins do not go with {len(along)} directions")
        count = len(along) if len(start) == 1 else len(start)
        if toward not in ("film", "scene"):
            raise ValueError(f"`toward` is `film` or `scene`, not `{toward}`")
        if not 1 <= threads <= 1024:
            raise ValueError(f"`threads` is from 1 to 1024, not {threads}")
        nm = None if wavelength is None else _wavelength(wavelength)
        z = None if at_z is None else float(at_z)
        if z is not None and not math.isfinite(z):
            raise ValueError(f"`at_z` is {z}, and a finite number is wanted")
        if out is None:
            # NumPy's own memory has large pages, which take a third of the time of small ones.
            places = np.empty((count, 3)), np.empty((count, 3))
            out = Rays(*places, np.empty(count, np.uint8), np.empty(count, np.int32))
        else:
            _check_out(out, count, start, along)
        rays = (out.origins, out.directions)
        self._core.trace(
            start, along, nm, toward == "scene", z, threads, rays, out.code, out.surface
        )
        return out

    def spot(self, x: float = 0.0, y: float = 0.0, *, grid: int = 32) -> Optional[Spot]:
        """Returns the spot of a distant point at a film point (mm), by grid × grid rays; `None`
        if it has no chief ray."""
        if not 1 <= grid <= 4096:
            raise ValueError("`grid` is from 1 to 4096")
        found = self._core.spot(float(x), float(y), self._film(), grid)
        return None if found is None else Spot(**found)

    def irradiance(self, points: npt.ArrayLike) -> Array:
        """Returns the irradiance in steradians at N × 2 film points (mm), for a scene of radiance
        1: ∫ cos⁴θ / Z² over the pupil.

        Raises:
            ValueError: a point is NaN, or the lens is afocal.
        """
        return self._core.irradiance(_known("points", rows("points", points, 2)), self._film())

    def illumination(self, heights: npt.ArrayLike) -> Array:
        """Returns the irradiance at N heights on the film's y axis (mm) over that on the axis."""
        y = _known("heights", _list("heights", heights))
        points = np.column_stack([np.zeros_like(y), y])
        on_axis = self.irradiance([[0.0, 0.0]])[0]
        relative: Array = self.irradiance(points) / on_axis
        return relative

    def distortion(self, heights: npt.ArrayLike, *, axis: str = "y") -> Dict[str, Array]:
        """Returns for N heights on an axis of the film (mm) the `angle` of the chief ray (rad),
        and the image height over f tan θ (`f_tan`) and f θ (`f_theta`), less 1."""
        if axis not in ("x", "y"):
            raise ValueError(f"`axis` is `x` or `y`, not `{axis}`")
        y = _list("heights", heights)
        found = self._core.distortion(y, axis == "x", self._film())
        return {"angle": found[:, 0], "f_tan": found[:, 1], "f_theta": found[:, 2]}

    def mtf(
        self,
        frequencies: Optional[Numbers] = None,
        fields: Optional[Fields] = None,
        *,
        diffraction: bool = True,
        film: Union[None, str, float, Sequence[float]] = None,
        defocus: float = 0.0,
    ) -> Modulation:
        """Returns the modulation transfer.

        Args:
            frequencies: line pairs per millimeter, above 0 [41 from 0 that suit the film].
            fields: heights in millimeters, or `"70%"`, or `"20deg"` [0, 50, 70 and 100%].
            diffraction: whether by waves; otherwise by rays alone.
            film: its sides or its diagonal in millimeters [the stated field].
            defocus: a shift of the film away from the lens, millimeters.
        """
        kind = "diffraction" if diffraction else "geometric"
        conditions = {"frequencies": frequencies, "fields": fields, "film": film}
        sheet = self.data(curves=True, defocus=defocus, **conditions)["curves"]
        if sheet is None:
            raise ValueError(f"`{self.name}` has no image")
        points = sheet["points"]
        return Modulation(
            np.asarray(sheet["frequencies"], dtype=np.float64),
            np.asarray([point["height"] for point in points], dtype=np.float64),
            np.asarray([point[kind]["tangential"] for point in points], dtype=np.float64),
            np.asarray([point[kind]["sagittal"] for point in points], dtype=np.float64),
        )

    def psf(
        self,
        fields: Optional[Fields] = None,
        *,
        wavelengths: Union[None, Numbers, Mapping[float, float], Mapping[int, float]] = None,
        size: int = 160,
        film: Union[None, str, float, Sequence[float]] = None,
        defocus: float = 0.0,
    ) -> PointSpread:
        """Returns the images of points by diffraction, all at one scale.

        Args:
            fields: heights in millimeters, or `"70%"`, or `"20deg"` [0, 50, 70 and 100%].
            wavelengths: nanometers, or a dictionary with the weight of each; `None` is white light
                in three colors.
            size: the pixels across each image, from 8 to 1024.
            film: its sides or its diagonal in millimeters [the stated field].
            defocus: a shift of the film away from the lens, millimeters.

        Raises:
            ArgumentError: an image is too blurred for plane waves (stop the lens down), or the
                lens is afocal.
            ValueError: a wrong size, field, wavelength or weight.
        """
        if not 8 <= size <= 1024:
            raise ValueError("`size` is from 8 to 1024")
        if not math.isfinite(defocus):
            raise ValueError("`defocus` is not finite")
        places = [_field(field) for field in (() if fields is None else fields)]
        waves = None if wavelengths is None else _waves(wavelengths)
        found = self._core.psf(places, waves, size, _half_diagonal(film), float(defocus))
        images: Array = found["images"]
        one_color = images if waves is None else images[..., 0]
        return PointSpread(one_color, found["heights"], found["pitch"])

    def data(self, *, curves: bool = False, **conditions: Any) -> Dict[str, Any]:
        """Returns what `ivcam lens --json` prints; with `curves` also the data sheet's curves,
        fans, wavefronts and Seidel sums, under `curves` and `aberrations`.

        `conditions` go with `curves`: `defocus` (mm), `fields`, `frequencies` (lp/mm) and `film` (mm).
        """
        words = _conditions(conditions)
        found = self._json("--json", *(["--curves"] if curves else []), *words)
        if curves:
            found.setdefault("curves", None)
            found.setdefault("aberrations", None)
        return found

    def fans(self, **conditions: Any) -> List[Dict[str, Any]]:
        """Returns the ray and wave fans, a dictionary for each field: see `data`."""
        sheet = self.data(curves=True, **conditions)["aberrations"]
        points: List[Dict[str, Any]] = [] if sheet is None else sheet["points"]
        return points

    def export(
        self,
        format: str,
        path: Optional[PathLike] = None,
        *,
        size: Optional[Sequence[int]] = None,
        model: Optional[str] = None,
        tolerance: Optional[float] = None,
        **conditions: Any,
    ) -> str:
        """Returns the lens for another program, or writes it: `opencv`, `ros`, `opentrackio`,
        `lensfun`, `stmap`, `psf`, `osl`, `zmx`, `seq` or `json`. `stmap` and `psf` need a path
        that ends in .exr.

        Args:
            size: the width and height of the picture in pixels.
            model: the camera model, as `ivcam lens --model` takes it.
            tolerance: how well the model fits, in pixels.
            **conditions: `film` (mm) and `defocus` (mm).
        """
        words = [f"--export={format}"]
        if path is not None:
            words.append(f"--output={os.fspath(path)}")
        if size is not None:
            words.append(f"--size={_joined(size, 'x')}")
        if model is not None:
            words.append(f"--model={model}")
        if tolerance is not None:
            words.append(f"--residual={tolerance}")
        return self._output(*words, *_conditions(conditions))

    def save(self, path: PathLike) -> None:
        """Writes the prescription: .dat (pbrt's four columns), .zmx, .seq or .json."""
        self._output(f"--write={os.fspath(path)}")

    def save_psf(self, path: PathLike, **conditions: Any) -> None:
        """Draws the images of points with diffraction, as a picture file."""
        self._output(f"--psf={os.fspath(path)}", *_conditions(conditions))

    def save_sheet(self, path: PathLike, **conditions: Any) -> None:
        """Writes the data sheet as one page: .html or .svg."""
        self._output(f"--sheet={os.fspath(path)}", *_conditions(conditions))

    def best_focus(self, distance: float = math.inf) -> float:
        """Returns the z of the film (mm) with the smallest spot on the axis, for an object at a
        distance from the front vertex (mm); NaN if too few rays pass."""
        if math.isnan(distance):
            raise ValueError("`distance` is NaN")
        z = self._core.best_focus(float(distance))
        return math.nan if z is None else z

    def to_svg(self) -> str:
        """Returns the section of the lens with rays as SVG."""
        return self._core.svg()

    def _repr_svg_(self) -> str:
        return self.to_svg()

    def __repr__(self) -> str:
        return f"<ivcam.Lens {self.name}: {self.efl:.4g} mm f/{self.f_number:.3g}>"

    def _film(self) -> float:
        z = self.film_z
        if math.isnan(z):
            raise ValueError(f"`{self.name}` has no film: it is afocal")
        return z

    def _output(self, *words: str) -> str:
        text, messages = self._core.output(list(words))
        warn_texts(messages, 5)
        return text

    def _json(self, *words: str) -> Dict[str, Any]:
        data: Dict[str, Any] = json.loads(self._output(*words))
        return data


def _check_out(out: Rays, count: int, *queries: Array) -> None:
    """Raises a ValueError unless `count` rays can be written into `out`, or a TypeError."""
    if not isinstance(out, Rays):
        raise TypeError(f"`out` is the result of an earlier `trace`, not {type(out).__name__}")
    kinds = {"origins": np.float64, "directions": np.float64, "code": np.uint8, "surface": np.int32}
    for name, kind in kinds.items():
        array: npt.NDArray[Any] = getattr(out, name)
        shape = (count, 3) if kind is np.float64 else (count,)
        if array.shape != shape or array.dtype != kind:
            raise ValueError(
                f"`out.{name}` is {array.dtype} of the shape {array.shape}, and "
                f"{np.dtype(kind)} of {shape} is wanted"
            )
        if not array.flags.c_contiguous or not array.flags.writeable:
            raise ValueError(f"`out.{name}` is not contiguous or may not be written")
        if any(np.may_share_memory(array, query) for query in queries):
            raise ValueError(f"`out.{name}` is also an array of the rays to trace")
    for name, other in itertools.combinations(kinds, 2):
        if np.may_share_memory(getattr(out, name), getattr(out, other)):
            raise ValueError(f"`out.{name}` and `out.{other}` share memory")


def _wavelength(nm: float) -> float:
    nm = float(nm)
    if not 100.0 <= nm <= 100_000.0:
        raise ValueError(f"a wavelength of {nm} nm can't be traced; visible light is 380 to 750")
    return nm


def _field(field: Union[float, str]) -> Tuple[str, float]:
    """Returns the unit (mm, % or deg) and the number of a place on the film's diagonal."""
    unit, number = "mm", field
    if isinstance(field, str):
        unit = next((unit for unit in ("%", "deg", "mm") if field.endswith(unit)), "mm")
        number = field[: -len(unit)] if field.endswith(unit) else field
    try:
        value = float(number)
    except ValueError:
        value = math.nan
    if not 0.0 <= value < 1e6:
        raise ValueError(f'a field is a height in mm, "70%" or "20deg", not {field!r}')
    return unit, value


def _waves(
    wavelengths: Union[Numbers, Mapping[float, float], Mapping[int, float]],
) -> List[Tuple[float, float]]:
    """Returns wavelengths in nanometers with their weights."""
    if isinstance(wavelengths, Mapping):
        pairs = [(_wavelength(nm), float(weight)) for nm, weight in wavelengths.items()]
    else:
        pairs = [(_wavelength(nm), 1.0) for nm in wavelengths]
    whole = sum(weight for _, weight in pairs)
    if not pairs or min(weight for _, weight in pairs) < 0.0 or not 0.0 < whole < math.inf:
        raise ValueError("`wavelengths` needs weights of 0 or more, one of them above 0")
    return pairs


def _half_diagonal(film: Union[None, str, float, Sequence[float]]) -> Optional[float]:
    """Returns half of the diagonal of a film in millimeters."""
    if film is None:
        return None
    if isinstance(film, str):
        sides = [float(side) for side in film.lower().replace("mm", "").split("x")]
    elif isinstance(film, (int, float, np.number)):
        sides = [float(film)]
    else:
        sides = [float(side) for side in film]
    if len(sides) not in (1, 2) or not all(0.0 < side < 1e6 for side in sides):
        raise ValueError(f"`film` is a diagonal, or a width and a height in mm, not {film!r}")
    return 0.5 * math.hypot(*sides)


def _number(value: Optional[float]) -> float:
    return math.nan if value is None else value


def _list(name: str, value: npt.ArrayLike) -> Array:
    array = numbers(name, value)
    if array.ndim == 0:
        array = array.reshape(1)
    if array.ndim != 1:
        raise ValueError(f"`{name}` has the shape {array.shape}, and one dimension is wanted")
    return array


def _known(name: str, array: Array) -> Array:
    """Returns an array, or raises a ValueError if it has a NaN."""
    if np.isnan(array).any():
        raise ValueError(f"`{name}` has a NaN")
    return array


def _plain(value: Any) -> Any:
    """Returns a number or an array of NumPy as one of Python."""
    if isinstance(value, (np.generic, np.ndarray)):
        return value.tolist()
    raise TypeError(f"a prescription has no {type(value).__name__}, such as {value!r}")


def _joined(value: Any, between: str) -> str:
    if isinstance(value, (str, bytes)) or not hasattr(value, "__iter__"):
        return str(value)
    return between.join(str(part) for part in value)


def _conditions(conditions: Mapping[str, Any]) -> List[str]:
    """Returns the conditions of a data sheet as words of a command line."""
    between = {"defocus": ",", "fields": ",", "frequencies": ",", "film": "x"}
    words = []
    for name, value in conditions.items():
        if name not in between:
            known = ", ".join(between)
            raise TypeError(f"unexpected keyword argument `{name}`: the conditions are {known}")
        if value is not None:
            words.append(f"--{name}={_joined(value, between[name])}")
    return words


def lenses() -> List[str]:
    """Returns the names of the lenses that come with the package."""
    return _ivcam.shipped_lenses()
