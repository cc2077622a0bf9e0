"""The same lens in ivcam, optiland and rayoptics, and the same rays through each.

Each builder takes a prescription of `ivcam.Lens.prescription()` with spheres, planes, a stop and
rotational aspheres. The media have their index at one wavelength, so that the libraries' glass
formulas do not matter. Origins are relative to the first vertex.
"""

from __future__ import annotations

from typing import Any, Callable, Dict, List, Tuple

import numpy as np

import ivcam

#: The wavelength in nanometers: the d line, for which prescriptions state their index.
WAVELENGTH = 587.5618

Record = Dict[str, Any]
#: A function that takes N × 3 origins and directions and returns N × 2 film points, NaN if lost.
Tracer = Callable[[np.ndarray, np.ndarray], np.ndarray]


def surfaces(lens: ivcam.Lens) -> List[Record]:
    """Returns the surfaces with `radius` (inf for a plane), `conic`, `powers` (coefficients of r^1,
    r^2, …), `thickness`, `index` (after the surface) and `aperture` (the semi-diameter)."""
    found = []
    for surface in lens.prescription()["surfaces"]:
        terms = {int(power): c for power, c in surface.get("radial_poly", {}).items()}
        radius = surface.get("R") or np.inf
        found.append(
            {
                "radius": radius,
                "conic": surface.get("k", 0.0),
                "powers": [terms.get(power, 0.0) for power in range(1, max(terms, default=0) + 1)],
                "thickness": surface["t"],
                "index": surface["n_d"],
                "aperture": surface["semi_diameter"],
                "stop": surface["kind"] == "stop",
            }
        )
    return found


def bundle(lens: ivcam.Lens, count: int) -> Tuple[np.ndarray, np.ndarray]:
    """Returns random parallel rays, 3 degrees off the axis, that fill the entrance pupil. They begin
    5 mm before the first vertex."""
    rng = np.random.default_rng(1)
    pupil = lens.first_order["entrance_pupil"]
    radius = pupil["semi_diameter"] * np.sqrt(rng.uniform(size=count))
    angle = rng.uniform(0, 2 * np.pi, count)
    direction = np.array([0.0, np.sin(np.radians(3)), np.cos(np.radians(3))])
    origins = np.column_stack(
        [radius * np.cos(angle), radius * np.sin(angle), np.full(count, -5.0)]
    )
    origins[:, :2] += direction[:2] / direction[2] * (-5.0 - pupil["z"])
    return origins, np.tile(direction, (count, 1))


def of_ivcam(lens: ivcam.Lens) -> Tracer:
    """ivcam on one thread."""
    film = lens.prescription()["surfaces"]
    film_z = sum(surface["t"] for surface in film)

    def trace(origins: np.ndarray, directions: np.ndarray) -> np.ndarray:
        return lens.trace(origins, directions, WAVELENGTH, at_z=film_z).origins[:, :2]

    return trace


def of_ivcam_again(lens: ivcam.Lens) -> Tracer:
    """ivcam on one thread, with the arrays of the call before."""
    film_z = sum(surface["t"] for surface in lens.prescription()["surfaces"])
    kept: Dict[int, ivcam.Rays] = {}

    def trace(origins: np.ndarray, directions: np.ndarray) -> np.ndarray:
        out = kept.get(len(origins))
        rays = lens.trace(origins, directions, WAVELENGTH, at_z=film_z, out=out)
        kept[len(origins)] = rays
        return rays.origins[:, :2]

    return trace


def of_optiland(lens: ivcam.Lens, backend: str = "numpy") -> Tracer:
    """optiland in double precision, without the record of every surface. Its backend is chosen anew
    for each call, as the libraries alternate."""
    import optiland.backend as be
    from optiland.materials import IdealMaterial
    from optiland.optic import Optic
    from optiland.rays import RealRays

    be.set_backend(backend)
    if backend == "torch":
        import torch

        torch.set_num_threads(1)
        be.set_precision("float64")
        be.grad_mode.disable()
    optic = Optic()
    optic.surfaces.add(index=0, thickness=10.0)
    for number, surface in enumerate(surfaces(lens), 1):
        shape = {"surface_type": "odd_asphere", "coefficients": surface["powers"]}
        optic.surfaces.add(
            index=number,
            radius=surface["radius"],
            conic=surface["conic"],
            thickness=surface["thickness"],
            material=IdealMaterial(surface["index"]),
            is_stop=surface["stop"],
            aperture=2 * surface["aperture"],
            **(shape if surface["powers"] else {}),
        )
    optic.surfaces.add(index=len(surfaces(lens)) + 1)
    optic.set_aperture(aperture_type="EPD", value=1.0)
    optic.add_field(y=0)
    optic.add_wavelength(value=WAVELENGTH / 1000, is_primary=True)

    def trace(origins: np.ndarray, directions: np.ndarray) -> np.ndarray:
        be.set_backend(backend)
        one = np.ones(len(origins))
        columns = [*origins.T, *directions.T, one, one * WAVELENGTH / 1000]
        rays = RealRays(*(be.array(np.array(column)) for column in columns))
        optic.surfaces.trace(rays, skip=1, record=False)
        points = np.column_stack([be.to_numpy(rays.x), be.to_numpy(rays.y)])
        points[~(be.to_numpy(rays.i) > 0)] = np.nan
        return points

    return trace


def of_rayoptics(lens: ivcam.Lens) -> Tracer:
    """rayoptics, which traces one ray at a time."""
    from rayoptics.elem.profiles import RadialPolynomial
    from rayoptics.elem.surface import Circular
    from rayoptics.environment import OpticalModel
    from rayoptics.raytr import raytrace
    from rayoptics.raytr.traceerror import TraceError

    model = OpticalModel()
    sequence = model["seq_model"]
    sequence.gaps[0].thi = 10.0
    for surface in surfaces(lens):
        curvature = 0.0 if np.isinf(surface["radius"]) else 1.0 / surface["radius"]
        sequence.add_surface([curvature, surface["thickness"], surface["index"]])
        added = sequence.ifcs[sequence.cur_surface]
        added.clear_apertures = [Circular(radius=surface["aperture"])]
        if surface["powers"]:
            powers = surface["powers"] + [0.0] * (10 - len(surface["powers"]))
            added.profile = RadialPolynomial(c=curvature, cc=surface["conic"], coefs=powers)
        if surface["stop"]:
            sequence.set_stop()
    sequence.do_apertures = False
    model.update_model()
    sequence.ifcs[-1].clear_apertures = [Circular(radius=1e6)]

    def trace(origins: np.ndarray, directions: np.ndarray) -> np.ndarray:
        points = np.full((len(origins), 2), np.nan)
        last = len(sequence.ifcs) - 1
        for number, (origin, direction) in enumerate(zip(origins, directions)):
            start = origin + np.array([0.0, 0.0, 10.0])
            try:
                ray, _, _ = raytrace.trace(
                    sequence,
                    start,
                    direction,
                    WAVELENGTH,
                    check_apertures=True,
                    intersect_obj=False,
                    last_surf=last,
                )
            except TraceError:
                continue
            points[number] = ray[-1][0][:2]
        return points

    return trace


def of_optiland_torch(lens: ivcam.Lens) -> Tracer:
    """optiland on PyTorch, on one thread."""
    import torch  # noqa: F401  # An ImportError leaves it out.

    return of_optiland(lens, "torch")


#: The libraries by name; what follows a comma says how.
BUILDERS: Dict[str, Callable[[ivcam.Lens], Tracer]] = {
    "ivcam": of_ivcam,
    "ivcam, `out=`": of_ivcam_again,
    "optiland, NumPy and Numba": of_optiland,
    "optiland, PyTorch": of_optiland_torch,
    "rayoptics": of_rayoptics,
}


def tracers(lens: ivcam.Lens) -> Dict[str, Tracer]:
    """Returns a function that traces for each library. One that is not installed, or that needs a
    network to be imported (rayoptics from 0.9.10 on fetches tables of glass), is left out with a
    word."""
    found = {}
    for library, build in BUILDERS.items():
        try:
            found[library] = build(lens)
        except (ImportError, OSError) as error:
            print(f"{library} is left out: {error}")
    return found
