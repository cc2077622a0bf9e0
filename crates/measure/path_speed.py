#!/usr/bin/env python3
"""Measures how long model `path`, Mitsuba 3 and Cycles take to the same error, on one thread:

    python crates/measure/path_speed.py target/release/ivcam [--only SCENE] [--programs NAME,...] [--rounds N]
        [--size WxH] [--error E] [--depth N] [--limit SECONDS] [--means | --lenses] [--keep FOLDER]

It needs the Python packages `mitsuba`, `bpy` (Python 3.11) and `numpy`, and a library of LLVM (19
works; 15 does not with AVX-512). The scenes are those of `path_scenes.py`; textures and highlights
are left out for all programs, and light that has been scattered more than `--depth` times. The
first table has each program's own pinhole: the picture's mean beside ivcam's, with the standard
error by the scatter of its seeds. It shows that the scenes are equal. The second has the lenses:
ivcam's is the double Gauss of 50 mm at full aperture, and that of the others a thin lens of the
same focal length, f-number and focus, as that of `ivcam-ideal`; `cycles-osl` has the double Gauss
as ivcam exports it.

An error is the RMS difference of all channels from a picture of many samples by the same program
and camera, over the mean of that picture, whose own error is subtracted (from the scatter of the
pictures that it is the mean of). Each program makes pictures of two numbers of samples around the
one that a first picture promises, in turn with the others, with new seeds in each round. Medians of
the rounds give the time to the error on the line through both in logarithms. Seconds are of the
processor, without reading, building and the compilation of kernels; those of ivcam are of the
process, less those of a process that renders one sample of 12x8 pixels. `--limit` bounds the
seconds of a picture; a time with * is beyond the measured points, by the inverse square of the
error. `--means` makes the first table only, `--lenses` the second; `--keep` keeps the scenes and
pictures.
"""

import json
import math
import os
import subprocess
import sys
import tempfile
from dataclasses import asdict

import mitsuba as mi
import numpy as np

import path_scenes

PROGRAMS = ("ivcam", "ivcam-adaptive", "ivcam-ideal", "llvm_ad_rgb", "scalar_rgb", "cycles", "cycles-osl")
LENS = ["--lens", "double-gauss", "--efl", "50mm"]
IDEAL = ["--lens", "ideal", "--efl", "50mm", "--aperture", "2.02"]
# The samples of the picture that promises the others, and the pictures whose mean is the reference.
PILOT, PICTURES = 16, 4


def option(name, default):
    return sys.argv[sys.argv.index(name) + 1] if name in sys.argv else default


SIZE = [int(word) for word in option("--size", "96x64").split("x")]
ERROR, DEPTH = float(option("--error", "0.03")), int(option("--depth", "8"))
LIMIT, ROUNDS = float(option("--limit", "20")), int(option("--rounds", "3"))


class Ivcam:
    def __init__(self, program, folder, name, pinhole):
        self.output, self.report = (os.path.join(folder, file) for file in ("ivcam.exr", "report.json"))
        self.words = [program, "render", os.path.join(folder, "scene.iv"), "-s", "i", "--dispersion", "off", "--headlight=off",
                      "--threads", "1", "--max-depth", str(DEPTH), "--quiet", "--report", self.report, "-o", self.output]
        self.words += ["--lens", "none"] if pinhole else IDEAL if name == "ivcam-ideal" else LENS
        self.words += ["--adaptive"] if name == "ivcam-adaptive" else []
        self.set_up = min(self.run(1, 0, [12, 8]) for _ in range(3))

    def run(self, samples, seed, size):
        words = ["--samples", str(samples), "--seed", str(seed), "--size", "{}x{}".format(*size)]
        subprocess.run(self.words + words, check=True)
        with open(self.report, encoding="utf-8") as file:
            return json.load(file)["processor_seconds"]

    def render(self, samples, seed):
        seconds = self.run(samples, seed, SIZE) - self.set_up
        return seconds, np.array(mi.Bitmap(self.output), dtype=np.float64)[..., :3]


class Peer:
    def __init__(self, program, folder, name, pinhole):
        camera = "pinhole" if pinhole else "lens"
        if name == "cycles-osl":
            camera = osl_camera(program, folder)
        script = os.path.join(os.path.dirname(os.path.abspath(__file__)), "path_peers.py")
        words = [sys.executable, script, name.removesuffix("-osl"), os.path.join(folder, "scene.glb"),
                 os.path.join(folder, "scene.json"), camera]
        with open(os.path.join(folder, f"{name}.log"), "w", encoding="utf-8") as log:
            self.process = subprocess.Popen(words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=log, text=True)
        self.output = os.path.join(folder, f"{name}.npy")
        if self.process.stdout.readline() != "ready\n":
            with open(log.name, encoding="utf-8") as said:
                sys.exit(f"{name} does not start:\n" + "".join(said.readlines()[-5:]))

    def render(self, samples, seed):
        print(samples, seed, self.output, sep="\t", file=self.process.stdin, flush=True)
        seconds = float(self.process.stdout.readline())
        return seconds, np.load(self.output).astype(np.float64)

    def end(self):
        self.process.stdin.close()
        self.process.wait()


def osl_camera(program, folder):
    with open(os.path.join(folder, "scene.json"), encoding="utf-8") as file:
        focus = json.load(file)["camera"]["focus"]
    output = os.path.join(folder, "lens.osl")
    words = [program, "lens", *LENS[1:], "--film", "36x24", "--focus", f"{focus:.7g}", "--export", "osl", "-o", output]
    subprocess.run(words, check=True, capture_output=True)
    return output


def started(program, folder, name, pinhole=False):
    return (Ivcam if name.startswith("ivcam") else Peer)(program, folder, name, pinhole)


def write(scene, program, folder):
    path, about = os.path.join(folder, "scene.iv"), os.path.join(folder, "scene.json")
    with open(path, "w", encoding="ascii") as file:
        file.write(path_scenes.inventor(scene))
    with open(about, "w", encoding="ascii") as file:
        json.dump({"camera": asdict(scene.camera), "lights": scene.lights, "size": SIZE, "depth": DEPTH,
                   "sampler": option("--sampler", "multijitter")}, file)
    words = [program, "convert", path, "--force", "-o", os.path.join(folder, "scene.glb")]
    subprocess.run(words, check=True, capture_output=True)


def keep(name, program, picture):
    folder = option("--keep", None)
    if folder:
        np.save(os.path.join(folder, f"{name}-{program}".replace(" ", "-") + ".npy"), picture.astype(np.float32))


def row(*cells):
    print("| " + " | ".join(cells) + " |", flush=True)


def means(name, program, folder, names):
    """The first table's rows: 4 pictures of 64 samples."""
    first = None
    for other in (other for other in names if other == "ivcam" or not other.startswith("ivcam") and other != "cycles-osl"):
        made = started(program, folder, other, pinhole=True)
        pictures = np.array([made.render(64, 1 + seed)[1] for seed in range(4)])
        keep(f"{name}-pinhole", other, pictures.mean(axis=0))
        levels = pictures.mean(axis=(1, 2, 3))
        mean, error = levels.mean(), levels.std(ddof=1) / math.sqrt(len(levels))
        if first is None:
            first = mean, error
        else:
            relative = math.hypot(error / mean, first[1] / first[0])
            row(name, other, f"{100 * (mean / first[0] - 1):+.2f}% ± {100 * relative:.2f}%")
        if isinstance(made, Peer):
            made.end()


class Measured:
    """What is known of one program's pictures of a scene."""

    def __init__(self, made):
        self.made = made
        pilot = [made.render(PILOT, 9000 + k) for k in range(2)]
        mean = np.mean([picture for _, picture in pilot])
        error = np.sqrt(np.mean((pilot[0][1] - pilot[1][1]) ** 2) / 2) / mean
        needed = PILOT * (error / ERROR) ** 2
        most = PILOT * LIMIT / max(pilot[1][0], 1e-3)
        low = 2 ** math.floor(math.log2(max(min(needed, most / 2), 4)))
        self.points = {low: [], 2 * low: []}
        self.reference, self.own = self.make_reference(2 * low)

    def make_reference(self, samples):
        """The mean of pictures, and the square of its own error."""
        pictures = np.array([self.made.render(samples, 5000 + k)[1] for k in range(PICTURES)])
        return pictures.mean(axis=0), np.mean(pictures.var(axis=0, ddof=1)) / PICTURES

    def round(self, seed):
        for count, points in self.points.items():
            seconds, picture = self.made.render(count, seed)
            square = np.mean((picture - self.reference) ** 2) - self.own
            points.append((seconds, math.sqrt(max(square, 0)) / self.reference.mean()))

    def medians(self):
        return {count: tuple(np.median(points, axis=0)) for count, points in self.points.items()}

    def seconds_to(self, error):
        """Seconds to an error, and a mark if it is not between the points."""
        (t0, e0), (t1, e1) = self.medians().values()
        if e1 <= error <= e0:
            return t0 * (t1 / t0) ** (math.log(e0 / error) / math.log(e0 / e1)), ""
        t, e = (t1, e1) if error < e1 else (t0, e0)
        return t * (e / error) ** 2, "*"


def lenses(name, program, folder, names):
    """The second table's rows."""
    all_made = {other: Measured(started(program, folder, other)) for other in names}
    for seed in range(ROUNDS):
        for measured in all_made.values():
            measured.round(1 + seed)
    first = None
    for other, measured in all_made.items():
        keep(name, other, measured.reference)
        seconds, beyond = measured.seconds_to(ERROR)
        first = first or seconds
        points = ", ".join(f"{count}: {t:.2f} s, {e:.4f}" for count, (t, e) in measured.medians().items())
        row(name, other, points, f"{seconds:.2f}{beyond}", f"{seconds / first:.2f}", f"{measured.reference.mean():.4f}")
        if isinstance(measured.made, Peer):
            measured.made.end()


def main():
    mi.set_variant("scalar_rgb")
    program, only = os.path.abspath(sys.argv[1]), option("--only", "")
    names = option("--programs", ",".join(PROGRAMS)).split(",")
    tables = []
    if "--lenses" not in sys.argv:
        tables.append((means, ("scene", "pinhole of", "mean beside ivcam's")))
    if "--means" not in sys.argv:
        tables.append((lenses, ("scene", "program", "samples: seconds, relRMSE", f"s to {ERROR:g}", "times the first", "mean")))
    print("{}x{}".format(*SIZE), f"pixels, {DEPTH} surfaces, {ROUNDS} rounds, Mitsuba {mi.__version__}")
    with tempfile.TemporaryDirectory() as folder:
        folders = {}
        for name in (name for name in path_scenes.SCENES if only in name):
            folders[name] = option("--keep", None) and os.path.join(option("--keep", None), name.replace(" ", "-")) \
                or os.path.join(folder, name)
            os.makedirs(folders[name], exist_ok=True)
            scene = path_scenes.make(name, program, folders[name])
            write(scene, program, folders[name])
            print(f"{name}: {scene.triangles()} triangles")
        for make_rows, titles in tables:
            print()
            row(*titles)
            print("|---" * len(titles) + "|")
            for name, place in folders.items():
                make_rows(name, program, place, names)


if __name__ == "__main__":
    main()
