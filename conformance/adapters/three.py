"""The VRMLLoader of three.js in Node.js. THREE names the folder whose node_modules has the package `three`."""

import json
import os

from adapters.support import run
from run import Refused

HERE = os.path.dirname(__file__)
MODULES = os.environ.get("THREE", ".")
READS = ["vrml97"]
GIVES = ["box", "triangles", "messages"]


def version():
    with open(os.path.join(MODULES, "node_modules/three/package.json"), encoding="utf-8") as package:
        return "three.js " + json.load(package)["version"]


def read(path, kinds, size, time, folder):
    done = run("node", os.path.join(HERE, "three.mjs"), MODULES, path)
    if done.returncode:
        raise Refused(done.stderr.strip()[-200:])
    return json.loads(done.stdout)
