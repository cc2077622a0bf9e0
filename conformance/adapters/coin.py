"""Coin, by the program that `inventor.cpp` makes: `coin` on the PATH, or the one that the variable COIN names."""

import json
import os

from adapters.support import ppm, run
from run import Refused
from scene_text import roots

PROGRAM = os.environ.get("COIN", "coin")
READS = ["inventor-1.0", "inventor-2.0", "inventor-2.1", "inventor-binary", "vrml-1.0", "vrml97"]
GIVES = ["tree", "box", "triangles", "camera", "picture", "messages"]
TIME = True


def version():
    return os.environ.get("COIN_VERSION", "Coin")


def read(path, kinds, size, time, folder):
    return answer(PROGRAM, path, kinds, size, time, folder)


def answer(program, path, kinds, size, time, folder):
    """Asks a program that `inventor.cpp` makes."""
    width, height = size if "picture" in kinds else (0, 0)
    done = run(program, path, time, width, height, folder / "coin.ppm", folder / "coin.iv")
    found = json.loads(done.stdout[done.stdout.index('{"read"'):])
    if not found["read"]:
        raise Refused(" ".join(found["messages"]))
    tree = roots((folder / "coin.iv").read_text(errors="replace").replace("VRML", ""))
    found["tree"] = tree[0]["children"] if found["wrapped"] and tree else tree
    found["picture"] = ppm(folder / "coin.ppm")
    return {"box": None, **found}
