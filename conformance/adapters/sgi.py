"""SGI's own Open Inventor 2.1.5, by the program that `inventor.cpp` makes: `sgi`, or what the variable SGI names."""

import os

from adapters.coin import answer

PROGRAM = os.environ.get("SGI", "sgi")
READS = ["inventor-1.0", "inventor-2.0", "inventor-2.1", "inventor-binary", "vrml-1.0"]
GIVES = ["tree", "box", "triangles", "camera", "picture", "messages"]
TIME = False


def version():
    return "SGI Open Inventor 2.1.5-10"


def read(path, kinds, size, time, folder):
    return answer(PROGRAM, path, kinds, size, time, folder)
