"""ivcam: `ivcam` on the PATH, or the program that the variable IVCAM names."""

import json
import os

from adapters.support import ppm, run
from run import Refused
from scene_text import roots

PROGRAM = os.environ.get("IVCAM", "ivcam")
READS = ["inventor-1.0", "inventor-2.0", "inventor-2.1", "inventor-binary", "vrml-1.0", "vrml97"]
GIVES = ["tree", "box", "triangles", "camera", "picture", "messages"]
TIME = True


def version():
    return run(PROGRAM, "--version").stdout.strip()


def read(path, kinds, size, time, folder):
    checked = run(PROGRAM, "check", path, "--json", "--scene-time", time)
    found = json.loads(checked.stdout or "{}")
    if found.get("state", "unreadable") == "unreadable":
        raise Refused(checked.stderr)
    wrong = [d["message"] for d in found["diagnostics"] if d["severity"] != "note"]
    answer = {"box": found["bounds"], "triangles": found["triangles"], "messages": wrong, "camera": camera(found)}
    if "tree" in kinds:
        answer["tree"] = roots(run(PROGRAM, "convert", path, "--to", "ascii", "--scene-time", time).stdout)
    if "picture" in kinds:
        headlight = [] if "vrml97" in path.parts else ["--headlight=off"]  # in VRML97 the file decides
        run(PROGRAM, "render", path, "--lens", "none", "-s", "g", *headlight, "--size", "{}x{}".format(*size),
            "--samples", 1, "--scene-time", time, "-o", folder / "ivcam.ppm")
        answer["picture"] = ppm(folder / "ivcam.ppm")
    return answer


def camera(found):
    from adapters.support import direction

    seen = found["camera"]
    if seen:
        turn = seen["orientation"]
        seen["direction"] = direction(turn["axis"], turn["angle"])
        seen["angle"] = seen.get("heightAngle", seen.get("fieldOfView"))
    return seen
