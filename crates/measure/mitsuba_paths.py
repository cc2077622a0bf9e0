#!/usr/bin/env python3
"""Compares model `path` with Mitsuba 3, pixel by pixel, on scenes that it writes for both:

    python crates/measure/mitsuba_paths.py target/release/ivcam [--only SCENE] [--seeds N] [--samples N]

It needs the Python packages `mitsuba` and `numpy`. `--variant llvm_ad_rgb` needs a library of LLVM too, and
`--keep FOLDER` keeps the means and the z of each pixel. Both programs render each scene through a pinhole, with
the same number of samples and N seeds. A pixel's z is the difference of the two means
over their standard error, which is the scatter of a program's pictures over its seeds; the mean of the three
channels counts. Each row has the scene, the relative difference of the pictures' means with its standard
error, the share of pixels with |z| above 4, the share that Student's t leaves there for equal programs, and
the largest |z|. Pixels without any scatter are compared for equality within 1e-5.

Both programs have the same surfaces here: matte, mirror, clear glass, and luminous. Mitsuba has no facets whose
shadowing is height-correlated, so a ball of Phong's values is compared with the formulas of `facets.py`.
"""

import math
import os
import subprocess
import sys
import tempfile

import mitsuba as mi
import numpy as np

import facets

WIDTH, HEIGHT, ANGLE = 96, 64, 0.785398


def matte(*color):
    return "matte", color


def glow(*color):
    return "glow", color


def phong(diffuse, specular, shininess):
    return "phong", (diffuse, specular, shininess)


MIRROR = "mirror", (0.95, 0.95, 0.95)
GLASS = "glass", (1.5,)


def box(x, y, z, width, height, depth, material):
    return "box", (x, y, z), (width, height, depth), material


def ball(x, y, z, radius, material):
    return "ball", (x, y, z), radius, material


WALLS = [
    box(-1.55, 0, 0, 0.1, 3, 9, matte(0.7, 0.1, 0.1)), box(1.55, 0, 0, 0.1, 3, 9, matte(0.1, 0.6, 0.15)),
    box(0, -1.55, 0, 3, 0.1, 9, matte(0.75, 0.7, 0.65)), box(0, 1.55, 0, 3, 0.1, 9, matte(0.75, 0.75, 0.75)),
    box(0, 0, -1.55, 3, 3, 0.1, matte(0.75, 0.75, 0.75)),
]
BLOCKS = [ball(0.5, -1.0, 0.2, 0.5, matte(0.5, 0.6, 0.7)), box(-0.6, -1.0, -0.4, 0.7, 1.0, 0.7, matte(0.8, 0.8, 0.5))]
FLOOR = box(0, -1.05, -1, 9, 0.1, 9, matte(0.6, 0.6, 0.55))

# The parts of each scene, the level of its even sky, a point light's place and intensity, and whether a
# picture lights it.
SCENES = {
    "room": {"parts": [*WALLS, *BLOCKS, box(0, 1.4, 0, 0.8, 0.02, 0.8, glow(12, 10, 8))]},
    "room, point light": {"parts": [*WALLS, *BLOCKS], "point": ((0.2, 1.1, 0.4), 0.6)},
    "mirror corridor": {"parts": [
        box(-1.2, 0, -2, 0.05, 3, 12, MIRROR), box(1.2, 0, -2, 0.05, 3, 12, MIRROR),
        box(0, -1.55, -2, 2.35, 0.1, 12, matte(0.6, 0.6, 0.6)), ball(0.2, 1.0, 0.5, 0.3, glow(6, 5, 4)),
        *(ball(0.45 * (-1) ** k, 0.2 * k - 0.7, 1.0 - k, 0.2, matte(0.7, 0.6, 0.2)) for k in range(6))]},
    "glass": {"parts": [FLOOR, ball(-0.2, -0.4, 0.5, 0.55, GLASS), ball(-1.0, 2.2, -0.5, 0.7, glow(4, 4, 4)),
                        box(0.9, -0.6, -0.8, 0.6, 0.8, 0.6, matte(0.2, 0.4, 0.7))]},
    "even sky": {"parts": [FLOOR, *BLOCKS[1:], ball(0.6, -0.5, 0, 0.5, matte(0.7, 0.3, 0.2))], "sky": 0.8},
    "environment picture": {"parts": [FLOOR, *BLOCKS[1:], ball(0.6, -0.5, 0, 0.5, matte(0.7, 0.3, 0.2))],
                            "picture": True},
    "studio": {"parts": [
        box(0, -1.05, 0, 9, 0.1, 9, matte(0.75, 0.75, 0.75)), box(0, 2, -3.5, 9, 6, 0.1, matte(0.75, 0.75, 0.75)),
        ball(-0.2, -0.2, 0, 0.8, matte(0.6, 0.2, 0.15)), box(0.9, -0.7, 0.5, 0.5, 0.6, 0.5, matte(0.2, 0.4, 0.5)),
        box(-3, 2.5, 2.5, 1.6, 1.6, 0.02, glow(9, 9, 9)), box(3.5, 1.5, 2, 0.02, 1.5, 1.5, glow(2, 2, 2)),
        box(1.5, 3, -2, 0.8, 0.02, 0.8, glow(8, 8, 8))]},
    **{f"facets, shininess {shininess}": {
        "parts": [ball(0, 0, 0, 1.4, phong((0.5, 0.3, 0.1), (0.1, 0.2, 0.3), shininess))], "point": ((2, 2.5, 3), 12)}
       for shininess in (0.05, 0.2, 0.8)},
}


def triple(values):
    return " ".join(f"{v:.6g}" for v in values)


def inventor_material(kind, values):
    black = "diffuseColor 0 0 0 ambientColor 0 0 0"
    return "Material { " + {
        "matte": lambda: f"diffuseColor {triple(values)} ambientColor {triple(values)}",
        "glow": lambda: f"{black} emissiveColor {triple(values)}",
        "mirror": lambda: f"{black} specularColor {triple(values)} shininess 1",
        "glass": lambda: "fields [ MFColor diffuseColor, MFColor ambientColor, MFFloat transparency, "
                         f"SFFloat refractionIndex ] {black} transparency 1 refractionIndex {values[0]}",
        "phong": lambda: f"ambientColor 0 0 0 diffuseColor {triple(values[0])} specularColor {triple(values[1])} "
                         f"shininess {values[2]}",
    }[kind]() + " }"


def inventor(scene):
    level = scene.get("sky", 0)
    lines = ["#Inventor V2.1 ascii", f"PerspectiveCamera {{ position 0 0 4 heightAngle {ANGLE} }}",
             f"Environment {{ ambientIntensity {level} attenuation 1 0 0 }}"]
    if "point" in scene:
        place, intensity = scene["point"]
        lines.append(f"PointLight {{ location {triple(place)} intensity {intensity} }}")
    for shape, place, size, material in scene["parts"]:
        text = f"Sphere {{ radius {size} }}" if shape == "ball" else \
            "Cube {{ width {} height {} depth {} }}".format(*size)
        lines.append(f"Separator {{ {inventor_material(*material)} Translation {{ translation {triple(place)} }} {text} }}")
    return "\n".join(lines) + "\n"


def mitsuba_surface(kind, values):
    def rgb(value):
        return {"type": "rgb", "value": list(value)}
    if kind == "glow":
        return {"bsdf": {"type": "diffuse", "reflectance": rgb((0, 0, 0))},
                "emitter": {"type": "area", "radiance": rgb(values)}}
    if kind == "mirror":
        return {"bsdf": {"type": "conductor", "material": "none", "specular_reflectance": rgb(values)}}
    if kind == "glass":
        return {"bsdf": {"type": "dielectric", "int_ior": values[0], "ext_ior": 1.0}}
    return {"bsdf": {"type": "twosided", "bsdf": {"type": "diffuse", "reflectance": rgb(values)}}}


def mitsuba(scene, picture):
    place = mi.ScalarTransform4f()
    parts = {
        "type": "scene", "integrator": {"type": "path", "max_depth": -1, "rr_depth": 8},
        # A camera of Inventor looks along -z, and one of Mitsuba along +z with x to the left.
        "sensor": {
            "type": "perspective", "fov_axis": "y", "fov": math.degrees(ANGLE), "near_clip": 0.01,
            "to_world": place.translate([0, 0, 4]).rotate([0, 1, 0], 180),
            "film": {"type": "hdrfilm", "width": WIDTH, "height": HEIGHT, "pixel_format": "rgb",
                     "component_format": "float32", "rfilter": {"type": "box"}},
            "sampler": {"type": "independent", "sample_count": 16},
        },
    }
    for k, (shape, at, size, material) in enumerate(scene["parts"]):
        surface = mitsuba_surface(*material)
        if shape == "ball":
            parts[f"part{k}"] = {"type": "sphere", "center": list(at), "radius": size, **surface}
        else:
            half = [0.5 * s for s in size]
            parts[f"part{k}"] = {"type": "cube", "to_world": place.translate(list(at)).scale(half), **surface}
    if "point" in scene:
        at, intensity = scene["point"]
        # Inventor's matte surface shows its color times the intensity, without the factor 1/pi.
        level = {"type": "rgb", "value": [math.pi * intensity] * 3}
        parts["point"] = {"type": "point", "position": list(at), "intensity": level}
    if "sky" in scene:
        parts["sky"] = {"type": "constant", "radiance": {"type": "rgb", "value": [scene["sky"]] * 3}}
    if "picture" in scene:
        parts["sky"] = {"type": "envmap", "bitmap": mi.Bitmap(picture),
                        "to_world": place.rotate([0, 1, 0], ENVIRONMENT_TURN)}
    return mi.load_dict(parts)


# Mitsuba's picture has +z where ivcam's has -z: half a turn.
ENVIRONMENT_TURN = 180


def environment_picture(rows):
    """A smooth sky of 2048x1024 pixels with a soft bright sun, so that the filter of texels does not matter.

    `rows` has the place of each row from the zenith, 0, to the nadir, 1.
    """
    v, u = np.meshgrid(rows, (np.arange(2048) + 0.5) / 2048, indexing="ij")
    polar, turn = v * np.pi, (u - 0.5) * 2 * np.pi
    direction = np.stack([np.sin(polar) * np.sin(turn), np.cos(polar), -np.sin(polar) * np.cos(turn)], axis=-1)
    sun = np.array([0.5, 0.6, 0.62]) / np.linalg.norm([0.5, 0.6, 0.62])
    near = np.exp((direction @ sun - 1) * 60)
    sky = np.clip(0.3 + 0.3 * direction[..., 1], 0.05, None)
    return np.stack([sky + 6 * near, sky * 1.1 + 5 * near, sky * 1.4 + 4 * near], axis=-1).astype(np.float32)


def ivcam_pictures(program, folder, scene, picture, samples, seeds):
    file = os.path.join(folder, "scene.iv")
    with open(file, "w", encoding="ascii") as out:
        out.write(inventor(scene))
    made = []
    for seed in range(seeds):
        output = os.path.join(folder, "picture.exr")
        words = [program, "render", file, "--shading", "path", "--colors", "linear", "--lens", "none", "--headlight=off",
                 "--size", f"{WIDTH}x{HEIGHT}", "--samples", str(samples), "--seed", str(seed + 1), "--mirrors", "0.3",
                 "--quiet", "-o", output]
        words += ["--environment-light", picture] if "picture" in scene else []
        words += ["--background", triple([scene["sky"]] * 3).replace(" ", ",")] if "sky" in scene else []
        subprocess.run(words, check=True)
        made.append(np.array(mi.Bitmap(output), dtype=np.float64)[..., :3])
        os.remove(output)
    return np.array(made)


def other_pictures(scene, picture, samples, seeds):
    (shape, place, size, (kind, values)), *_ = scene["parts"]
    if kind == "phong":
        surface, random = facets.Facets(*values), np.random.default_rng(1)
        view = 4, ANGLE, WIDTH, HEIGHT
        return np.array([facets.picture(surface, (place, size), scene["point"], view, random, samples) for _ in range(seeds)])
    loaded = mitsuba(scene, picture)
    return np.array([np.array(mi.render(loaded, spp=samples, seed=seed), dtype=np.float64) for seed in range(seeds)])


def student_tail(limit, freedom):
    """The probability of |t| above a limit, by numeric integration."""
    t = np.linspace(limit, limit + 200, 400_001)
    logarithm = math.lgamma((freedom + 1) / 2) - math.lgamma(freedom / 2) - 0.5 * math.log(freedom * math.pi)
    density = np.exp(logarithm - (freedom + 1) / 2 * np.log1p(t * t / freedom))
    return 2 * float(np.sum(density) * (t[1] - t[0]))


def compare(name, ours, theirs):
    ours, theirs = ours.mean(axis=-1), theirs.mean(axis=-1)
    n = len(ours)
    a, b = ours.mean(axis=0), theirs.mean(axis=0)
    variance_a, variance_b = ours.var(axis=0, ddof=1) / n, theirs.var(axis=0, ddof=1) / n
    variance = variance_a + variance_b
    still = variance < 1e-14
    z = np.where(still, np.where(np.abs(a - b) > 1e-5, np.inf, 0), (a - b) / np.sqrt(np.maximum(variance, 1e-300)))
    total = b.mean()
    error = math.sqrt(variance.sum()) / variance.size / total
    # Welch's degrees of freedom, of the median pixel.
    pairs = (variance_a ** 2 + variance_b ** 2)[~still]
    freedom = (n - 1) * float(np.median(variance[~still] ** 2 / np.maximum(pairs, 1e-300)))
    cells = [name, f"{100 * (a.mean() / total - 1):+.3f}% ± {100 * error:.3f}%", f"{100 * np.mean(np.abs(z) > 4):.3f}%",
             f"{100 * student_tail(4, freedom):.3f}%", f"{np.max(np.abs(z)):.1f}", f"{np.mean(z):+.3f}"]
    print("| " + " | ".join(cells) + " |", flush=True)
    return z


def option(name, default):
    return sys.argv[sys.argv.index(name) + 1] if name in sys.argv else default


def main():
    mi.set_variant(option("--variant", "scalar_rgb"))
    program, only = os.path.abspath(sys.argv[1]), option("--only", "")
    seeds, samples, keep = int(option("--seeds", "32")), int(option("--samples", "16")), option("--keep", None)
    print(f"| {WIDTH}x{HEIGHT}, {seeds} x {samples} samples | means | beyond 4σ | expected | largest | mean z |\n|---|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as folder:
        picture, of_mitsuba = os.path.join(folder, "sky.exr"), os.path.join(folder, "sky-of-mitsuba.exr")
        mi.Bitmap(environment_picture((np.arange(1024) + 0.5) / 1024)).write(picture)
        # Mitsuba's first and last row are the zenith and the nadir themselves, and it interpolates. With one
        # picture of 512x256 for both programs the background differs by 0.1%: 4 to 13 sigma.
        mi.Bitmap(environment_picture(np.arange(1024) / 1023)).write(of_mitsuba)
        for name, scene in SCENES.items():
            if only in name:
                ours = ivcam_pictures(program, folder, scene, picture, samples, seeds)
                theirs = other_pictures(scene, of_mitsuba, samples, seeds)
                z = compare(name, ours, theirs)
                if keep:
                    np.savez(os.path.join(keep, name.replace(" ", "-") + ".npz"), ours=ours.mean(0), theirs=theirs.mean(0), z=z)


if __name__ == "__main__":
    main()
