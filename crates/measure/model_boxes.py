"""Compares boxes and triangles of OBJ, PLY, STL and glTF files with those that trimesh reads.

    python3 crates/measure/model_boxes.py PROGRAM FOLDER

Boxes agree if no side differs by more than 1e-5 of the box's diagonal. Needs trimesh and numpy.
"""

import collections
import json
import os
import subprocess
import sys

import numpy
import trimesh

ENDINGS = (".obj", ".ply", ".stl", ".gltf", ".glb")


def ours(program, path):
    """Returns the box, the number of triangles and the first problem, by `ivcam check`."""
    ran = subprocess.run([program, "check", "--json", path], capture_output=True, text=True, timeout=120)
    try:
        found = json.loads(ran.stdout)
    except json.JSONDecodeError:
        return None, 0, ran.stderr.strip().split("\n")[0]
    found = found["files"][0] if "files" in found else found
    messages = [m.get("message", "") for m in found.get("diagnostics", found.get("messages", []))]
    error = found.get("error")
    box = found.get("bounds")
    box = numpy.array([box["min"], box["max"]] if isinstance(box, dict) else box) if box else None
    return box, found.get("triangles", 0), error or (messages or [""])[0]


def theirs(path):
    """Returns the box and the number of triangles by trimesh, or the error."""
    try:
        scene = trimesh.load_scene(path, process=False)
        box = scene.bounds
        return box, sum(len(m.faces) for m in scene.dump() if hasattr(m, "faces")), ""
    except BaseException as error:  # trimesh raises errors of every kind
        return None, 0, f"{type(error).__name__}: {error}".split("\n")[0][:100]


def result(a, b):
    if a is None or b is None:
        return {(True, True): "neither", (True, False): "trimesh only", (False, True): "ivcam only"}[a is None, b is None]
    size = numpy.linalg.norm(b[1] - b[0])
    return "same box" if abs(a - b).max() <= 1e-5 * max(size, 1e-30) else "other box"


def main():
    program, folder = sys.argv[1:3]
    counts = collections.defaultdict(collections.Counter)
    for base, _, names in sorted(os.walk(folder)):
        for name in sorted(names):
            ending = os.path.splitext(name)[1].lower()
            if ending not in ENDINGS:
                continue
            path = os.path.join(base, name)
            (box, triangles, said), (other, others, error) = ours(program, path), theirs(path)
            found = result(box, other)
            counts[ending]["files"] += 1
            counts[ending][found] += 1
            counts[ending]["same triangles"] += found == "same box" and triangles == others
            if found != "same box" or triangles != others:
                print(f"{name}: {found}, {triangles} and {others} triangles; {said} | {error}")
                if found == "other box":
                    print("   ", box.tolist(), other.tolist())
    columns = ["files", "same box", "same triangles", "other box", "ivcam only", "trimesh only", "neither"]
    print("\n| format | " + " | ".join(columns) + " |\n|---" * 1 + "|---" * len(columns) + "|")
    for ending, row in sorted(counts.items()):
        print(f"| {ending[1:].upper()} | " + " | ".join(str(row[c]) for c in columns) + " |")


main()
