"""What the modules share: warnings, and checks of arrays."""

from __future__ import annotations

import os
import warnings
from numbers import Real
from typing import Any, Callable, Dict, Iterable, Optional, Union

import numpy as np
import numpy.typing as npt

from ._errors import IvcamWarning

Array = npt.NDArray[np.float64]
PathLike = Union[str, "os.PathLike[str]"]


def scene_file(path: PathLike) -> str:
    """Returns the name of a scene's file. A file `-` is one, and not standard input."""
    name = os.fspath(path)
    return os.path.join(os.curdir, name) if name == "-" else name


def checked_call(progress: Optional[Callable[..., object]]) -> None:
    """Raises a TypeError unless `progress` is a function or `None`."""
    if progress is not None and not callable(progress):
        raise TypeError(f"`progress` is a function, not {progress!r}")


def text_of(problem: Dict[str, Any]) -> str:
    """Returns a problem as one line with its place and help."""
    place = ""
    if problem.get("file"):
        place = f"{problem['file']}: "
        if problem.get("line"):
            place = f"{problem['file']}:{problem['line']}:{problem['column']}: "
        elif problem.get("byte") is not None:
            place += f"byte {problem['byte']}: "
    times = f" ({problem['count']} times)" if problem.get("count", 1) > 1 else ""
    help = f" ({problem['help']})" if problem.get("help") else ""
    return f"{place}{problem['message']}{times}{help}"


def warn(problems: Iterable[Dict[str, Any]], level: int = 3) -> None:
    """Shows problems as warnings of Python."""
    for problem in problems:
        warnings.warn(text_of(problem), IvcamWarning, stacklevel=level)


def warn_texts(texts: Iterable[str], level: int = 4) -> None:
    """Shows lines as warnings of Python."""
    for text in texts:
        warnings.warn(text.strip(), IvcamWarning, stacklevel=level)


def numbers(name: str, value: npt.ArrayLike) -> Array:
    """Returns real numbers as a C-ordered array of doubles.

    Raises:
        TypeError: they are texts, complex numbers or other objects.
    """
    array = np.asarray(value)
    kind = array.dtype.kind
    if kind not in "biufO" or kind == "O" and not all(isinstance(v, Real) for v in array.flat):
        raise TypeError(f"`{name}` has {array.dtype} values, and real numbers are wanted")
    return np.ascontiguousarray(array, dtype=np.float64)


def rows(name: str, value: npt.ArrayLike, width: int) -> Array:
    """Returns numbers as a C-ordered array of N × width doubles; one row may be given alone.

    Raises:
        ValueError: the array has another shape.
        TypeError: it does not hold numbers.
    """
    array = numbers(name, value)
    if array.ndim == 1 and array.shape == (width,):
        array = array.reshape(1, width)
    if array.ndim != 2 or array.shape[1] != width:
        raise ValueError(f"`{name}` has the shape {array.shape}, and N × {width} is wanted")
    return array
