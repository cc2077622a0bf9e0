#!/usr/bin/env python3
"""Makes the references of lenses with mirrors, decentered surfaces and ideal lenses.

    python crates/measure/mirrors_reference.py > tests/lenses/reference/mirrors.json
    python crates/measure/mirrors_reference.py tilts > tests/lenses/reference/tilts.json
    python crates/measure/mirrors_reference.py thin > tests/lenses/reference/thin_lenses.json

Rays are traced by rayoptics, and by optiland, whose greatest difference from rayoptics is in the file.
The systems are written down here. Their first-order designs are those of textbooks: a Cassegrain of
conics, a Maksutov and a Maksutov with a corrector, a Mangin mirror and a Schmidt camera. Lengths are
in millimeters from the front vertex, and thicknesses and radii have the signs of a straight axis.
The decentered systems are no designs. Their places and angles in space, which optiland needs, are
computed here and not by rayoptics. Ideal lenses are traced by optiland alone: those of rayoptics are
holograms.
"""

import json
import math
import sys
from importlib.metadata import version

import numpy as np
from optiland.materials import IdealMaterial
from optiland.optic import Optic
from optiland.rays import RealRays
from rayoptics.elem.profiles import Conic, EvenPolynomial
from rayoptics.elem.surface import DecenterData
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

# The same rows, and the decenter: what the axis does behind it, the shift in x and y, and the angles about
# x, y and z in degrees, with the signs of CODE V.
TILTED = {
    "a decentered element": [
        (62.0, 6.0, 1.6204, 14.0, 0.0, (), None),
        (-180.0, 9.0, 1.0, 14.0, 0.0, (), None),
        (-48.0, 3.0, 1.7552, 10.0, 0.0, (), ("decenter", 0.7, -0.4, 2.0, -1.5, 10.0)),
        (71.0, 10.0, 1.0, 10.0, 0.0, (), ("reverse", 0.7, -0.4, 2.0, -1.5, 10.0)),
        (150.0, 5.0, 1.6204, 12.0, -0.5, (1e-6, -2e-9), ("dec and return", 0.0, 0.3, 0.0, 0.0, 25.0)),
        (-52.0, 70.0, 1.0, 12.0, 0.0, (), None),
    ],
    "a tilted plate and a wedge": [
        (80.0, 6.0, 1.5168, 12.0, 0.0, (), None),
        (-120.0, 30.0, 1.0, 12.0, 0.0, (), None),
        (0.0, 8.0, 1.7, 14.0, 0.0, (), ("decenter", 0.0, 0.0, 35.0, -20.0, 5.0)),
        (0.0, 10.0, 1.0, 14.0, 0.0, (), ("reverse", 0.0, 0.0, 35.0, -20.0, 5.0)),
        (0.0, 6.0, 1.5168, 14.0, 0.0, (), ("dec and return", 0.0, 0.0, -4.0, 0.0, 0.0)),
        (0.0, 20.0, 1.0, 14.0, 0.0, (), ("dec and return", 0.0, 0.0, 6.0, 3.0, 0.0)),
    ],
    "a fold mirror of 45 degrees": [
        (60.0, 5.0, 1.5168, 10.0, 0.0, (), None),
        (-90.0, 25.0, 1.0, 10.0, 0.0, (), None),
        (0.0, -20.0, None, 16.0, 0.0, (), ("bend", 0.0, 0.0, 45.0, 0.0, 0.0)),
        (-45.0, -4.0, 1.6204, 9.0, 0.0, (), None),
        (70.0, -30.0, 1.0, 9.0, 0.0, (), None),
    ],
    "two mirrors and a flat": [
        (0.0, 150.0, 1.0, 8.0, 0.0, (), None),
        (-300.0, -140.0, None, 25.0, -1.0, (), ("bend", 0.0, 0.0, 7.0, 0.0, 0.0)),
        (0.0, 145.0, None, 25.0, 0.0, (), ("bend", 0.0, 0.0, -11.0, 4.0, 0.0)),
        (-310.0, -155.0, None, 30.0, 0.0, (), ("bend", 0.0, 2.0, 6.0, 0.0, 0.0)),
    ],
}

# The same rows, and the focal length of an ideal lens.
THIN = {
    "behind a singlet": [
        (60.0, 4.0, 1.5168, 12.0, 0.0, (), None, None),
        (-200.0, 8.0, 1.0, 12.0, 0.0, (), None, None),
        (0.0, 40.0, 1.0, 11.0, 0.0, (), None, 80.0),
    ],
    "a telephoto of two": [
        (0.0, 30.0, 1.0, 12.0, 0.0, (), None, 50.0),
        (0.0, 20.0, 1.0, 8.0, 0.0, (), None, -35.0),
        (35.0, 3.0, 1.6204, 8.0, 0.0, (), None, None),
        (0.0, 10.0, 1.0, 8.0, 0.0, (), None, None),
    ],
    "between air and glass": [
        (0.0, 12.0, 1.5168, 10.0, 0.0, (), None, 45.0),
        (-70.0, 25.0, 1.0, 10.0, 0.0, (), None, None),
    ],
    "behind two mirrors": [
        (-400.0, -140.0, None, 25.0, -1.0, (), None, None),
        (-180.0, 120.0, None, 9.0, -4.0, (), None, None),
        (0.0, 10.0, 1.0, 10.0, 0.0, (), None, 150.0),
        (40.0, 3.0, 1.5168, 9.0, 0.0, (), None, None),
    ],
    "decentered and tilted": [
        (80.0, 5.0, 1.5168, 10.0, 0.0, (), None, None),
        (0.0, 15.0, 1.0, 10.0, 0.0, (), None, None),
        (0.0, 20.0, 1.0, 9.0, 0.0, (), ("dec and return", 0.5, -0.8, 4.0, 0.0, 0.0), 60.0),
        (50.0, 4.0, 1.6204, 9.0, 0.0, (), None, None),
    ],
}


def turn(alpha, beta, gamma):
    """The rotation from a tilted surface to the axis. The first two angles are left-handed."""
    a, b, c = (math.radians(v) for v in (-alpha, -beta, gamma))
    x = np.array([[1, 0, 0], [0, math.cos(a), -math.sin(a)], [0, math.sin(a), math.cos(a)]])
    y = np.array([[math.cos(b), 0, math.sin(b)], [0, 1, 0], [-math.sin(b), 0, math.cos(b)]])
    z = np.array([[math.cos(c), -math.sin(c), 0], [math.sin(c), math.cos(c), 0], [0, 0, 1]])
    return x @ y @ z


def frames(rows):
    """The rotation and the place of every surface, in the space of the front vertex."""
    rotation, place, found = np.eye(3), np.zeros(3), []
    for _, thickness, _, _, _, _, *decenter in rows:
        kind, dx, dy, *angles = decenter[0] if decenter and decenter[0] else (None, 0.0, 0.0, 0.0, 0.0, 0.0)
        shift, tilt = np.array([dx, dy, 0.0]), turn(*angles)
        if kind != "reverse":
            place, rotation = place + rotation @ shift, rotation @ tilt
        found.append((rotation, place))
        if kind in ("reverse", "dec and return"):
            rotation = rotation @ tilt.T
            place = place - rotation @ shift
        if kind == "bend":
            rotation = rotation @ tilt
        place = place + rotation @ [0.0, 0.0, thickness]
    return found


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
    for radius, thickness, index, _, k, terms, *decenter in rows:
        medium = ["REFL"] if index is None else [] if index == 1.0 else [index, 60.0]
        sequence.add_surface([radius, thickness, *medium])
        c = 1.0 / radius if radius else 0.0
        if terms:
            sequence.ifcs[sequence.cur_surface].profile = EvenPolynomial(c=c, cc=k, coefs=[0.0, *terms])
        elif k:
            sequence.ifcs[sequence.cur_surface].profile = Conic(c=c, cc=k)
        if decenter and decenter[0]:
            kind, dx, dy, *angles = decenter[0]
            data = DecenterData(kind, dx, dy, *angles)
            data.update()
            sequence.ifcs[sequence.cur_surface].decenter = data
    sequence.do_apertures = False
    model.update_model()
    rotation, place = frames(rows)[-1]

    def trace(origin, direction):
        # The object's surface is the plane of the ray's origin.
        sequence.gaps[0].thi = -origin[2]
        sequence.update_model()
        found, _, _ = raytrace.trace(sequence, np.array([*origin[:2], 0.0]), direction, NM)
        hit, out = found[-2][:2]
        return rotation @ hit + place, rotation @ out

    return trace


def by_optiland(rows):
    """The tracer of one ray, as that of rayoptics."""
    lens = Optic()
    lens.add_surface(index=0, thickness=np.inf)
    for i, ((radius, _, index, _, k, terms, *more), (rotation, place)) in enumerate(zip(rows, frames(rows))):
        shape = {"surface_type": "even_asphere", "coefficients": [0.0, *terms]} if terms else {}
        if more[1:] and more[1]:
            shape = {"surface_type": "paraxial", "f": more[1]}
        lens.add_surface(
            index=i + 1,
            radius=radius or np.inf,
            conic=k,
            **dict(zip("xyz", place)),
            rx=math.atan2(rotation[2, 1], rotation[2, 2]),
            ry=math.asin(-rotation[2, 0]),
            rz=math.atan2(rotation[1, 0], rotation[0, 0]),
            material="mirror" if index is None else IdealMaterial(n=index),
            is_stop=i == 0,
            **shape,
        )
    lens.add_surface(index=len(rows) + 1, **dict(zip("xyz", place + rotation @ [0.0, 0.0, rows[-1][1]])))
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
    kind = sys.argv[1] if sys.argv[1:] else "mirrors"
    for name, rows in {"mirrors": SYSTEMS, "tilts": TILTED, "thin": THIN}[kind].items():
        second = by_optiland(rows)
        first = second if kind == "thin" else by_rayoptics(rows)
        found, apart = [], 0.0
        for origin, direction in rays(rows[0][3]):
            hit, out = first(origin, direction)
            other, beside = second(origin, direction)
            apart = max(apart, np.abs(hit - other).max(), np.abs(out - beside).max())
            found.append([*origin, *direction, *hit, *out])
        systems[name] = {"rows": rows, "programs_differ_by": apart, "rays": found}
    programs = ("optiland",) if kind == "thin" else ("rayoptics", "optiland")
    versions = ", ".join(f"{name} {version(name)}" for name in programs)
    text = json.dumps({"programs": versions, "wavelength_nm": NM, "systems": systems})
    # One ray, or one surface, a line.
    print(text.replace("[[", "[\n[").replace("], [", "],\n["))


main()
