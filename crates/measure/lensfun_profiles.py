#!/usr/bin/env python3
"""Writes measured profiles of lenses for `measure -- profiles`.

    python crates/measure/lensfun_profiles.py FOLDER > profiles.json

FOLDER holds the XML files of Lensfun's database (CC BY-SA 3.0), such as `db_files` of the Python package
lensfunpy. Every product whose design ivcam ships is written with its measured distortion, vignetting and
lateral color as curves over the height on the film, in millimeters.

Lensfun's models, with heights r in half of the frame's shorter side (12 mm at crop factor 1):

  ptlens      r_d = r_u (a r_u^3 + b r_u^2 + c r_u + 1 - a - b - c)
  poly3       r_d = r_u (k1 r_u^2 + 1 - k1)
  tca poly3   r_color = r (v + c r + b r^2), r being the height of green
  vignetting  I = 1 + k1 r^2 + k2 r^4 + k3 r^6, with r in half of the diagonal (21.63 mm)

r_u is f tan(theta), or f theta for a fish-eye. Distortion is r_d/r_u over its value on the axis, less 1.
"""

import json
import sys
from pathlib import Path

import lensfunpy

HALF_SIDE = 12.0
HALF_DIAGONAL = 21.633
STEP = 0.5

# Our lens, its zoom position, the focal length to which it is scaled, Lensfun's maker and model, the focal
# length of the profile, and the greatest height on the film.
PRODUCTS = [
    ("nikkor-14-30", 1, None, "Nikon", "NIKKOR Z 14-30mm f/4 S", 14.0, HALF_DIAGONAL),
    ("nikkor-14-30", 2, None, "Nikon", "NIKKOR Z 14-30mm f/4 S", 20.0, HALF_DIAGONAL),
    ("nikkor-14-30", 3, None, "Nikon", "NIKKOR Z 14-30mm f/4 S", 30.0, HALF_DIAGONAL),
    ("micro-nikkor-60", None, None, "Nikon", "Nikon AF Micro-Nikkor 60mm f/2.8D", 60.0, HALF_DIAGONAL),
    ("takumar-50", None, 50.0, "Pentax", "Super-Takumar 50mm f/1.4", 50.0, HALF_DIAGONAL),
    ("takumar-50", None, 50.0, "Pentax", "Pentax SMC Takumar 50mm f/1.4", 50.0, HALF_DIAGONAL),
    ("canon-70-200", 1, None, "Canon", "Canon EF 70-200mm f/2.8L USM", 70.0, HALF_DIAGONAL),
    ("canon-70-200", 2, None, "Canon", "Canon EF 70-200mm f/2.8L USM", 135.0, HALF_DIAGONAL),
    ("canon-70-200", 3, None, "Canon", "Canon EF 70-200mm f/2.8L USM", 200.0, HALF_DIAGONAL),
]


def ratio(calibration, r):
    """r_d/r_u at r_u = r."""
    terms = calibration.terms
    if calibration.model == lensfunpy.DistortionModel.PTLENS:
        a, b, c = terms
        return a * r**3 + b * r**2 + c * r + 1 - a - b - c
    if calibration.model == lensfunpy.DistortionModel.POLY3:
        return terms[0] * r**2 + 1 - terms[0]
    raise SystemExit(f"the distortion model {calibration.model} is not handled")


def distortion(calibration, height):
    """The distortion in percent at a height on the film, found by bisection."""
    wanted = height / HALF_SIDE
    low, high = 0.0, 2.0 * wanted
    for _ in range(60):
        middle = 0.5 * (low + high)
        if middle * ratio(calibration, middle) < wanted:
            low = middle
        else:
            high = middle
    return 100.0 * (ratio(calibration, low) / ratio(calibration, 0.0) - 1.0)


def lateral(calibration, height):
    """The heights of red and blue less that of green, in micrometers."""
    if calibration.model != lensfunpy.TCAModel.POLY3:
        raise SystemExit(f"the model {calibration.model} of lateral color is not handled")
    v_red, v_blue, c_red, c_blue, b_red, b_blue = calibration.terms
    r = height / HALF_SIDE
    return [1000.0 * height * (v + c * r + b * r * r - 1.0)
            for v, c, b in [(v_red, c_red, b_red), (v_blue, c_blue, b_blue)]]


def profile(lens, entry):
    """The profile of one product at one focal length."""
    name, zoom, efl, _, model, focal, limit = entry
    heights = [STEP * i for i in range(int(limit / STEP) + 1)]
    shape = lens.interpolate_distortion(focal)
    words = {"PTLENS": "a, b, c", "POLY3": "k1"}[shape.model.name]
    used = shape.terms if shape.model.name == "PTLENS" else shape.terms[:1]
    found = {
        "lens": name, "zoom_position": zoom, "efl": efl, "product": model, "focal": focal,
        "coefficients": f"{words} = " + ", ".join(f"{v:.5g}" for v in used),
        "distortion": [[h, distortion(shape, h)] for h in heights],
        "vignetting": [],
    }
    if lens.calib_tca:
        color = lens.interpolate_tca(focal)
        both = [lateral(color, h) for h in heights]
        found["red"] = [[h, v[0]] for h, v in zip(heights, both)]
        found["blue"] = [[h, v[1]] for h, v in zip(heights, both)]
    near = [c for c in lens.calib_vignetting if c.distance >= 1000.0]
    if near:
        closest = min(abs(c.focal - focal) for c in near)
        near = [c for c in near if abs(c.focal - focal) == closest]
        widest = min(c.aperture for c in near)
        for chosen in sorted({widest, 8.0 if any(c.aperture == 8.0 for c in near) else 4.0}):
            terms = next(c.terms for c in near if c.aperture == chosen)
            light = [1.0 + sum(k * (h / HALF_DIAGONAL) ** (2 * i + 2) for i, k in enumerate(terms)) for h in heights]
            found["vignetting"].append({"f_number": round(chosen, 2), "light": list(map(list, zip(heights, light)))})
    return found


def main():
    if len(sys.argv) != 2:
        raise SystemExit(__doc__)
    files = sorted(str(path) for path in Path(sys.argv[1]).glob("*.xml"))
    database = lensfunpy.Database(paths=files, load_common=False, load_bundled=False)
    profiles = []
    for entry in PRODUCTS:
        maker, model = entry[3], entry[4]
        lenses = [l for l in database.lenses if l.maker == maker and l.model == model and l.crop_factor == 1.0]
        if not lenses:
            raise SystemExit(f"the database has no {model}")
        profiles.append(profile(lenses[0], entry))
    source = f"Lensfun {'.'.join(map(str, lensfunpy.lensfun_version[:3]))}, lensfunpy {lensfunpy.__version__}"
    json.dump({"source": source, "profiles": profiles}, sys.stdout, indent=1)


if __name__ == "__main__":
    main()
