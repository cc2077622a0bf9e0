#!/usr/bin/env python3
"""Makes the reference of `measure -- optics FOLDER aberrations=FILE` with other programs.

    python crates/measure/optics_reference.py IVCAM LENS... > reference.json

IVCAM is the program; it only states the prescriptions (`lens NAME --json`), which must be spherical.
Rays are traced by optiland, Seidel coefficients come from rayoptics, and Zernike polynomials, point
spreads and modulation from prysm. Lengths are in millimeters from the front vertex, and the wavelength
is that of the d line. The definitions are those of `src/lens/analysis/aberrations`.
"""

import json
import math
import subprocess
import sys

import numpy as np
from optiland.materials import IdealMaterial
from optiland.optic import Optic
from optiland.rays import RealRays
from prysm.otf import mtf_from_psf
from prysm.polynomials import fringe_to_nm, zernike_nm
from prysm.propagation import Wavefront
from rayoptics.optical.opticalmodel import OpticalModel
from rayoptics.parax.thirdorder import compute_third_order
from rayoptics.raytr.opticalspec import FieldSpec, PupilSpec, WvlSpec

NM = 587.5618
WAVE = NM * 1e-6
STEPS = 20
SAMPLES = 32
PSF = 256
F_NUMBER = 8
HEIGHTS = [0.0, 0.1]


class System:
    """A lens in optiland, with the last surface at the film."""

    def __init__(self, surfaces, film_z):
        self.surfaces = surfaces
        self.vertices = np.concatenate([[0.0], np.cumsum([s["thickness"] for s in surfaces[:-1]])])
        self.stop = next(i for i, s in enumerate(surfaces) if s["stop"])
        self.radii = np.array([s["semi_diameter"] for s in surfaces])
        lens = Optic()
        lens.add_surface(index=0, thickness=np.inf)
        for i, s in enumerate(surfaces):
            gap = s["thickness"] if i + 1 < len(surfaces) else film_z - self.vertices[-1]
            lens.add_surface(
                index=i + 1,
                radius=s["radius"] or np.inf,
                thickness=gap,
                material=IdealMaterial(n=s["n_d"]),
                is_stop=s["stop"],
            )
        lens.add_surface(index=len(surfaces) + 1)
        lens.add_wavelength(WAVE * 1e3, is_primary=True)
        lens.set_aperture("EPD", 1.0)
        lens.set_field_type("angle")
        lens.add_field(y=0)
        self.lens = lens
        self.film_z = film_z

    def trace(self, origin, direction):
        """Traces rays. Returns the points on all surfaces and on the film, directions and paths."""
        o = np.atleast_2d(origin)
        d = np.broadcast_to(direction, o.shape)
        ones = np.ones(len(o))
        rays = RealRays(*(o.T.copy()), *(d.T.copy()), ones, ones * WAVE * 1e3)
        self.lens.surface_group.trace(rays, skip=1)
        group = self.lens.surface_group
        hits = np.stack([np.array(group.x), np.array(group.y), np.array(group.z)], axis=-1)[-len(self.surfaces) - 1 :]
        out = np.stack([rays.L, rays.M, rays.N], axis=-1)
        return hits, out, np.array(rays.opd)

    def passes(self, hits):
        r = np.hypot(hits[:-1, :, 0], hits[:-1, :, 1])
        return np.all(r <= self.radii[:, None], axis=0)


class Point:
    """The rays of the point at infinity whose chief ray arrives at a height."""

    def __init__(self, system, height, radius, exit_pupil):
        self.system, self.radius = system, radius
        angle = 0.0
        if height:
            # The secant method for the angle of the chief ray.
            guess = [0.9 * height / system.efl, height / system.efl]
            values = [self.arrival_at(a) - height for a in guess]
            for _ in range(50):
                if values[1] == values[0]:
                    break
                new = guess[1] - values[1] * (guess[1] - guess[0]) / (values[1] - values[0])
                guess, values = [guess[1], new], [values[1], self.arrival_at(new) - height]
                if abs(values[1]) < 1e-13:
                    break
            angle = guess[1]
        self.arrival_at(angle)
        hits, out, opd = self.rays(self.chief[None, :])
        self.image = hits[-1][0]
        self.sphere = np.linalg.norm(self.image - np.array([0, 0, exit_pupil]))
        self.path = self.to_sphere(hits, out, opd)[0]

    def set_angle(self, angle):
        self.d = np.array([0.0, math.sin(angle), math.cos(angle)])
        self.up = np.array([0.0, math.cos(angle), -math.sin(angle)])

    def arrival_at(self, angle):
        self.set_angle(angle)
        self.chief = np.array([0.0, 0.0])
        self.chief = self.aim(np.array([[0.0, 0.0]]))[0]
        return self.rays(self.chief[None, :])[0][-1][0, 1]

    def rays(self, places):
        """Traces rays through places in a plane across the direction, through the stop's vertex."""
        base = np.array([0.0, 0.0, self.system.vertices[self.system.stop]])
        through = base + places[:, :1] * np.array([1.0, 0, 0]) + places[:, 1:] * self.up
        return self.system.trace(through - 300.0 * self.d, self.d)

    def at_stop(self, places):
        return self.rays(places)[0][self.system.stop][:, :2] / self.radius

    def aim(self, pupil):
        """Places whose rays cross the stop at pupil coordinates, by Newton's method."""
        h = 1e-4 * self.radius
        places = self.chief + pupil * self.radius
        for _ in range(12):
            miss = self.at_stop(places) - pupil
            dx = (self.at_stop(places + [h, 0]) - self.at_stop(places - [h, 0])) / (2 * h)
            dy = (self.at_stop(places + [0, h]) - self.at_stop(places - [0, h])) / (2 * h)
            jacobian = np.stack([dx, dy], axis=-1)
            change = np.linalg.solve(jacobian, miss[..., None])[..., 0]
            places = places - change
            if np.nanmax(np.abs(change)) < 1e-13 * self.radius:
                break
        return places

    def to_sphere(self, hits, out, opd):
        off = hits[-1] - self.image
        along = np.sum(off * out, axis=1)
        back = along + np.sqrt(along**2 - np.sum(off**2, axis=1) + self.sphere**2)
        return opd - back

    def measure(self, pupil):
        """Arrivals from the chief ray's, aberrations in waves, whether rays pass, and directions."""
        hits, out, opd = self.rays(self.aim(pupil))
        waves = (self.path - self.to_sphere(hits, out, opd)) / WAVE
        return (hits[-1] - self.image)[:, :2], waves, self.system.passes(hits), out


def paraxial(surfaces):
    """The focal length, the z of the focus, and the z of the exit pupil."""
    vertices = np.concatenate([[0.0], np.cumsum([s["thickness"] for s in surfaces[:-1]])])

    def walk(y, u, start):
        n = 1.0 if start == 0 else surfaces[start - 1]["n_d"]
        for i in range(start, len(surfaces)):
            s = surfaces[i]
            c = 1.0 / s["radius"] if s["radius"] else 0.0
            u = (n * u - y * c * (s["n_d"] - n)) / s["n_d"]
            n = s["n_d"]
            if i + 1 < len(surfaces):
                y = y + u * s["thickness"]
        return y, u

    y, u = walk(1.0, 0.0, 0)
    stop = next(i for i, s in enumerate(surfaces) if s["stop"])
    y2, u2 = walk(0.0, 1.0, stop)
    return -1.0 / u, vertices[-1] - y / u, vertices[-1] - y2 / u2


def widest(system):
    """The height in front of the lens, and at the stop, of the widest ray parallel to the axis."""

    def ray(y):
        return system.trace(np.array([[0.0, y, -100.0]]), np.array([0.0, 0.0, 1.0]))[0]

    low, high = 0.0, 1.5 * max(system.radii)
    for _ in range(100):
        middle = 0.5 * (low + high)
        hits = ray(middle)
        ok = np.all(np.isfinite(hits)) and system.passes(hits)[0]
        low, high = (middle, high) if ok else (low, middle)
    return low, abs(ray(low)[system.stop][0, 1])


def seidel(surfaces, marginal, height, efl):
    model = OpticalModel()
    model.radius_mode = True
    seq, spec = model["seq_model"], model["optical_spec"]
    spec["pupil"] = PupilSpec(spec, key=["object", "epd"], value=2 * marginal)
    angle = math.degrees(math.atan(height / efl))
    spec["fov"] = FieldSpec(spec, key=["object", "angle"], value=angle, flds=[0.0, 1.0], is_relative=True)
    spec["wvls"] = WvlSpec([(NM, 1.0)], ref_wl=0)
    # Farther off, the chief ray loses digits; nearer, the object is not at infinity: 1e-7 either way.
    seq.gaps[0].thi = 1e9
    for s in surfaces:
        seq.add_surface([s["radius"], s["thickness"], s["n_d"]])
        if s["stop"]:
            seq.set_stop()
    seq.gaps[-1].thi = paraxial(surfaces)[1] - sum(s["thickness"] for s in surfaces[:-1])
    model.update_model()
    table = compute_third_order(model)
    rows = table.iloc[: len(surfaces)][["S-I", "S-II", "S-III", "S-IV", "S-V"]]
    return rows.to_numpy().tolist()


def image(point, frequencies):
    """The Strehl ratio, and the modulation along y and x, by prysm from the wavefront at the stop."""
    cells = (2 * np.arange(PSF) + 1) / PSF - 1
    x, y = np.meshgrid(cells, cells)
    inside = x**2 + y**2 <= 1
    pupil = np.stack([x[inside], y[inside]], axis=1)
    _, waves, ok, out = point.measure(pupil)
    amplitude, phase = np.zeros(x.shape), np.zeros(x.shape)
    amplitude[inside] = ok
    phase[inside] = np.where(ok, waves, 0)
    # Without tilt, so that the image is in the middle of prysm's grid.
    plane = np.stack([np.ones(ok.sum()), *pupil[ok].T], axis=1)
    tilt = np.linalg.lstsq(plane, waves[ok], rcond=None)[0]
    phase -= np.where(amplitude > 0, tilt[0] + tilt[1] * x + tilt[2] * y, 0)
    modulation = []
    peak = 0.0
    for axis in (1, 0):
        # Direction cosines for each unit of the pupil.
        cosine = abs(np.polyfit(pupil[ok][:, axis], out[ok][:, axis], 1)[0])
        efl = 1.0
        dx = 2 * cosine * efl / PSF
        psfs = []
        for nm in (phase * NM, 0 * phase):
            wave = Wavefront.from_amp_and_phase(amplitude, nm, WAVE * 1e3, dx)
            psfs.append(wave.focus(efl, Q=4).intensity)
        peak = psfs[0].data.max() / psfs[1].data.max()
        mtf = mtf_from_psf(psfs[0].data, dx=psfs[0].dx)
        data = mtf.data
        middle = data.shape[0] // 2
        line = data[middle:, middle] if axis == 1 else data[middle, middle:]
        at = np.arange(len(line)) * mtf.dx
        modulation.append(np.interp(frequencies, at, line).tolist())
    return peak, modulation


def fan(point, axis):
    steps = np.arange(-STEPS, STEPS + 1) / STEPS
    pupil = np.zeros((len(steps), 2))
    pupil[:, axis] = steps
    arrivals, waves, ok, _ = point.measure(pupil)
    rows = zip(steps, arrivals, waves, ok)
    # The rim itself may round to either side.
    return [[p, *a, w] for p, a, w, good in rows if good and abs(p) < 1]


def zernike(point):
    cells = (2 * np.arange(SAMPLES) + 1) / SAMPLES - 1
    x, y = (a.ravel() for a in np.meshgrid(cells, cells))
    inside = x**2 + y**2 <= 1
    pupil = np.stack([x[inside], y[inside]], axis=1)
    _, waves, ok, _ = point.measure(pupil)
    open_share = ok.mean()
    terms = 37 if open_share > 0.6 else 16 if open_share > 0.3 else 9
    rho, theta = np.hypot(*pupil[ok].T), np.arctan2(pupil[ok][:, 1], pupil[ok][:, 0])
    orders = [fringe_to_nm(j) if j < 37 else (12, 0) for j in range(1, terms + 1)]
    basis = np.stack([zernike_nm(n, m, rho, theta, norm=False) for n, m in orders], axis=1)
    return np.linalg.lstsq(basis, waves[ok], rcond=None)[0].tolist(), open_share


def spot(point, frequencies):
    """The rms radius about the centroid of the spot of a grid of rays across the beam, and the
    modulation of lines by it, along y and x."""
    reach = 2.0 * max(r for r in point.system.radii if np.isfinite(r))
    low, high = -np.full(2, reach), np.full(2, reach)
    for size in (61, 61, 61, 401):
        x, y = (np.linspace(a, b, size) for a, b in zip(low, high))
        places = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
        hits, _, _ = point.rays(places)
        ok = point.system.passes(hits)
        step = (high - low) / (size - 1)
        low, high = places[ok].min(axis=0) - step, places[ok].max(axis=0) + step
    film = hits[-1][ok][:, :2] - hits[-1][ok][:, :2].mean(axis=0)
    phases = 2 * math.pi * np.array(frequencies)[:, None, None] * film
    modulation = np.abs(np.exp(1j * phases).mean(axis=1))
    rms = math.sqrt((film**2).sum(axis=1).mean())
    return rms, {"tangential": modulation[:, 1].tolist(), "sagittal": modulation[:, 0].tolist()}


def illumination(surfaces, film_z, height):
    """The irradiance of a point on the film by light of radiance 1: rays from the film, traced through
    the lens turned end for end, over a grid in the plane of the last vertex."""
    before = [1.0] + [s["n_d"] for s in surfaces[:-1]]
    gaps = [0.0] + [s["thickness"] for s in surfaces[:-1]]
    turned = [
        {**s, "radius": -s["radius"], "n_d": n, "thickness": gap}
        for s, n, gap in zip(surfaces, before, gaps)
    ][::-1]
    back = film_z - sum(gaps)
    system = System(turned, sum(gaps) + 1.0)
    origin = np.array([0.0, height, -back])

    def passing(x, y):
        places = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
        way = np.column_stack([places, np.zeros(len(places))]) - origin
        length = np.linalg.norm(way, axis=1)
        start = np.broadcast_to(origin, way.shape)
        hits, _, _ = system.trace(start, way / length[:, None])
        return places, system.passes(hits), (back / length) ** 4 / back**2

    reach = 1.2 * max(r for r in system.radii if np.isfinite(r))
    low, high = -np.full(2, reach), np.full(2, reach)
    for _ in range(3):
        places, ok, _ = passing(*(np.linspace(a, b, 81) for a, b in zip(low, high)))
        step = (high - low) / 80
        low, high = places[ok].min(axis=0) - step, places[ok].max(axis=0) + step
    parts, cells, light = 3, 250, 0.0
    step = (high - low) / (parts * cells)
    for k in range(parts * parts):
        shift = np.array([k % parts, k // parts]) + 0.5
        axes = [a + (parts * np.arange(cells) + s) * d for a, s, d in zip(low, shift, step)]
        _, ok, weights = passing(*axes)
        light += weights[ok].sum() * step.prod()
    return light


def prescription(program, name):
    """The surfaces of a lens that is closed to the f-number, with the index of the d line."""
    text = subprocess.run(
        [program, "lens", name, "--aperture", str(F_NUMBER), "--json"],
        check=True, capture_output=True, text=True,
    ).stdout
    return json.loads(text)["surfaces"]


def reference(program, name, more=False):
    """What the other programs say of a lens; with `more` its spots and illumination too."""
    surfaces = prescription(program, name)
    assert all(s["kind"] == "sphere" for s in surfaces), f"{name} is not spherical"
    efl, focus, exit_pupil = paraxial(surfaces)
    system = System(surfaces, focus)
    system.efl = efl
    marginal, radius = widest(system)
    frequencies = [10.0, 20.0, 40.0]
    points = []
    for share in HEIGHTS:
        height = share * efl
        point = Point(system, height, radius, exit_pupil)
        coefficients, open_share = zernike(point)
        strehl, (tangential, sagittal) = image(point, frequencies)
        points.append({
            "height": height, "tangential": fan(point, 1), "sagittal": fan(point, 0),
            "zernike": coefficients, "open": open_share, "strehl": strehl,
            "mtf": {"tangential": tangential, "sagittal": sagittal},
        })
        if more:
            points[-1]["rms"], points[-1]["by_rays"] = spot(point, frequencies)
            points[-1]["light"] = illumination(surfaces, focus, height)
        print(f"{name} {height:.2f} mm: Strehl {strehl:.3f}", file=sys.stderr)
    stop = next(s["semi_diameter"] for s in surfaces if s["stop"])
    height = 0.2 * efl
    return {
        "stop": stop, "film_z": focus, "marginal": marginal, "frequencies": frequencies,
        "seidel": {"height": height, "surfaces": seidel(surfaces, marginal, height, efl)},
        "points": points,
    }


def main():
    program, names = sys.argv[1], sys.argv[2:]
    lenses = {name: reference(program, name) for name in names}
    json.dump({"wavelength_nm": NM, "lenses": lenses}, sys.stdout)


if __name__ == "__main__":
    main()
