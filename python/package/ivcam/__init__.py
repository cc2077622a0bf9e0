"""Open Inventor and VRML scenes, real lenses, and photographs of the scenes through the lenses.

    import ivcam

    scene = ivcam.open("livroom.iv")        # nodes, cameras, lights, problems
    scene.triangles().positions             # arrays; scene.convert("livroom.glb")
    lens = ivcam.Lens("biogon", efl=50)     # first order, rays, spots, modulation, exports
    picture = ivcam.render(scene, lens="biogon", efl=50, focus=3.6, samples=16)
    picture.pixels, picture.error           # height × width × 3 float32, and how wrong it is
    ivcam.compare(picture, "old.png")       # how far it is from another picture
    ivcam.fit(scene, "old.png", lens="biogon", efl=50)      # where the camera stood

Scenes are in meters and lenses in millimeters; angles are in radians and wavelengths in
nanometers unless a name says otherwise. Errors are `IvcamError`, by kind, with the place in the
file and what to do; warnings are `IvcamWarning`.
"""

import atexit
from typing import List, Tuple

from . import _ivcam
from ._comparison import Alignment, Alternative, Fit, FitProgress, Frame, align, compare, fit
from ._errors import (
    ArgumentError,
    DamagedError,
    FileError,
    FocusError,
    IvcamError,
    IvcamWarning,
    LimitError,
    NotFoundError,
    OutsideFolderError,
    SceneSyntaxError,
    UnsupportedError,
)
from ._ivcam import Node, __version__
from ._lens import (
    BLOCKED,
    MISSED,
    PASSED,
    TOTAL_REFLECTION,
    Lens,
    Modulation,
    PointSpread,
    Rays,
    Spot,
    lenses,
)
from ._picture import Picture, Progress, render
from ._scene import Conversion, Document, Triangles, check, formats, open


# A daemon thread that renders would end the process by a fault when the interpreter ends.
atexit.register(_ivcam.end_calls)


def render_options() -> List[Tuple[str, str, str]]:
    """Returns the options of `render`: name, value and help."""
    return _ivcam.render_options()


def lens_options() -> List[Tuple[str, str, str]]:
    """Returns the options of `Lens`: name, value and help."""
    return _ivcam.lens_options()


__all__ = [
    "Alignment",
    "Alternative",
    "ArgumentError",
    "BLOCKED",
    "Conversion",
    "DamagedError",
    "Document",
    "FileError",
    "Fit",
    "FitProgress",
    "FocusError",
    "Frame",
    "IvcamError",
    "IvcamWarning",
    "Lens",
    "LimitError",
    "MISSED",
    "Modulation",
    "Node",
    "NotFoundError",
    "OutsideFolderError",
    "PASSED",
    "Picture",
    "PointSpread",
    "Progress",
    "Rays",
    "SceneSyntaxError",
    "Spot",
    "TOTAL_REFLECTION",
    "Triangles",
    "UnsupportedError",
    "__version__",
    "align",
    "check",
    "compare",
    "fit",
    "formats",
    "lens_options",
    "lenses",
    "open",
    "render",
    "render_options",
]

# Messages and `help` name things as programs do, and not by the file that they are in.
for _name in __all__:
    if getattr(globals()[_name], "__module__", "").startswith("ivcam._") and _name != "Node":
        globals()[_name].__module__ = __name__
del _name
