#!/usr/bin/env python3
"""Makes the reference of lenses with mirrors, `tests/lenses/reference/mirrors.json`.

    python crates/measure/mirrors_reference.py > tests/lenses/reference/mirrors.json

Rays are traced by rayoptics, and by optiland, whose greatest difference from rayoptics is in the file.
The systems are written down here. Their first-order designs are those of textbooks: a Cassegrain of
conics, a Maksutov and a Maksutov with a corrector, a Mangin mirror and a Schmidt camera. Lengths are
in millimeters from the front vertex, and thicknesses and radii have the signs of a straight axis.
"""

import json
import math
from importlib.metadata import version

import numpy as np
from optiland.materials import IdealMaterial
from optiland.optic import Optic
from optiland.rays import RealRays
from rayoptics.elem.profiles import Conic, EvenPolynomial
from rayoptics.optical.opticalmodel import OpticalModel
from rayoptics.raytr import raytrace

NM = 587.5618

# Rows of radius, thickness, index behind the surface or None for a mirror, semi-diameter, conic
# constant, and the coefficients of r^4 and r^6.
SYSTEMS = {
    "cassegrain": [
        (-400.0, -140.0, None, 25.0, -1.0, ()),
        (-180.0, 180.0, None, 9.0, -4.0, ()),
    ],
    "maksutov": [
        (-82.3, 9.0, 1.5168, 34.0, 0.0, ()),
        (-86.6, 125.0, 1.0, 35.0, 0.0, ()),
        (-398.0, -122.0, None, 37.0, 0.0, ()),
        (-296.0, 155.0, None, 15.0, 0.0, ()),
    ],
    "maksutov with a corrector": [
        (-81.3, 9.0, 1.5168, 34.0, 0.0, ()),
        (-85.6, 125.0, 1.0, 35.0, 0.0, ()),
        (-398.0, -122.0, None, 37.0, 0.0, ()),
        (-296.0, 102.0, None, 15.0, 0.0, ()),
        (900.0, 5.0, 1.5168, 13.0, 0.0, ()),
        (80.0, 30.0, 1.0, 13.0, 0.0, ()),
        (71.0, 3.0, 1.5168, 18.0, 0.0, ()),
        (215.0, 61.0, 1.0, 18.0, 0.0, ()),
    ],
    "mangin": [
        (-150.0, 6.0, 1.5168, 20.0, 0.0, ()),
        (-230.0, -6.0, None, 20.0, 0.0, ()),
        (-150.0, -190.0, 1.0, 20.0, 0.0, ()),
    ],
    "schmidt": [
        (0.0, 5.0, 1.5168, 30.0, 0.0, (-2.2e-8, -1e-13)),
        (0.0, 195.0, 1.0, 30.0, 0.0, ()),
        (-200.0, -100.0, None, 50.0, 0.0, ()),
    ],
}


def rays(radius):
    """Rays toward the front of a lens, at three angles to the axis."""
    for angle in (0.0, 1.0, 2.5):
        direction = np.array([math.sin(math.radians(0.3 * angle)), math.sin(math.radians(angle)), 0.0])
        direction[2] = math.sqrt(1.0 - direction @ direction)
        for height in (0.35, 0.65, 0.95):
            for turn in range(4):
                phase = 0.4 + math.tau * turn / 4
                place = height * radius * np.array([math.cos(phase), math.sin(phase), 0.0])
                yield place - 20.0 * direction, direction


def by_rayoptics(rows):
    """The tracer of one ray: the last hit and the direction behind it, in global coordinates."""
    model = OpticalModel(do_init=True)
    model.radius_mode = True
    sequence = model["seq_model"]
    sequence.gaps[0].thi = 1e10
    for radius, thickness, index, _, k, terms in rows:
        medium = ["REFL"] if index is None else [] if index == 1.0 else [index, 60.0]
        sequence.add_surface([radius, thickness, *medium])
        c = 1.0 / radius if radius else 0.0
        if terms:
            sequence.ifcs[sequence.cur_surface].profile = EvenPolynomial(c=c, cc=k, coefs=[0.0, *terms])
        elif k:
            sequence.ifcs[sequence.cur_surface].profile = Conic(c=c, cc=k)
    sequence.do_apertures = False
    model.update_model()
    vertices = np.concatenate([[0.0], np.cumsum([row[1] for row in rows])])

    def trace(origin, direction):
        # The object's surface is the plane of the ray's origin.
        sequence.gaps[0].thi = -origin[2]
        sequence.update_model()
        found, _, _ = raytrace.trace(sequence, np.array([*origin[:2], 0.0]), direction, NM)
        hit, out = found[-2][:2]
        return hit + [0.0, 0.0, vertices[len(rows) - 1]], out

    return trace


def by_optiland(rows):
    """The tracer of one ray, as that of rayoptics."""
    lens = Optic()
    lens.add_surface(index=0, thickness=np.inf)
    for i, (radius, thickness, index, _, k, terms) in enumerate(rows):
        shape = {"surface_type": "even_asphere", "coefficients": [0.0, *terms]} if terms else {}
        lens.add_surface(
            index=i + 1,
            radius=radius or np.inf,
            conic=k,
            thickness=thickness,
            material="mirror" if index is None else IdealMaterial(n=index),
            is_stop=i == 0,
            **shape,
        )
    lens.add_surface(index=len(rows) + 1)
    lens.add_wavelength(NM * 1e-3, is_primary=True)
    lens.set_aperture("EPD", 1.0)
    lens.set_field_type("angle")
    lens.add_field(y=0)
    group = lens.surface_group

    def trace(origin, direction):
        one = np.ones(1)
        traced = RealRays(*(np.array([v]) for v in (*origin, *direction)), one, one * NM * 1e-3)
        group.trace(traced, skip=1)
        at = lambda values: float(np.array(values)[-2].ravel()[0])
        hit = np.array([at(group.x), at(group.y), at(group.z)])
        return hit, np.array([at(group.L), at(group.M), at(group.N)])

    return trace


def main():
    systems = {}
    for name, rows in SYSTEMS.items():
        first, second = by_rayoptics(rows), by_optiland(rows)
        found, apart = [], 0.0
        for origin, direction in rays(rows[0][3]):
            hit, out = first(origin, direction)
            other, beside = second(origin, direction)
            apart = max(apart, np.abs(hit - other).max(), np.abs(out - beside).max())
            found.append([*origin, *direction, *hit, *out])
        systems[name] = {"rows": rows, "programs_differ_by": apart, "rays": found}
    versions = ", ".join(f"{name} {version(name)}" for name in ("rayoptics", "optiland"))
    text = json.dumps({"programs": versions, "wavelength_nm": NM, "systems": systems})
    # One ray, or one surface, a line.
    print(text.replace("[[", "[\n[").replace("], [", "],\n["))


main()
