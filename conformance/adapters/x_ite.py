"""X_ITE in headless Chromium. X_ITE names the folder whose node_modules has `x_ite` and `playwright-core`."""

import base64
import json
import os
import subprocess

from adapters.support import png
from run import Failed, Refused
from scene_text import roots

HERE = os.path.dirname(__file__)
MODULES = os.environ.get("X_ITE", ".")
READS = ["vrml97"]
GIVES = ["tree", "picture", "messages"]
browser = None


def version():
    with open(os.path.join(MODULES, "node_modules/x_ite/package.json"), encoding="utf-8") as package:
        return "X_ITE " + json.load(package)["version"]


def read(path, kinds, size, time, folder):
    global browser
    if browser is None:
        words = ["node", os.path.join(HERE, "x_ite.mjs"), MODULES, os.path.dirname(HERE)]
        browser = subprocess.Popen(words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    name = path.relative_to(os.path.dirname(HERE)).as_posix()
    browser.stdin.write(json.dumps({"file": name, "size": size}) + "\n")
    browser.stdin.flush()
    answer = json.loads(browser.stdout.readline())
    if "not done" in answer.get("refused", ""):
        raise Failed(answer["refused"])
    if "refused" in answer:
        raise Refused(answer["refused"])
    (folder / "x_ite.png").write_bytes(base64.b64decode(answer["picture"]))
    return {**answer, "tree": [vrml97(node) for node in roots(answer["tree"])], "picture": png(folder / "x_ite.png")}


def vrml97(node):
    """Gives the fields that X3D calls `children` their names of VRML97."""
    if "class" in node:
        for values in node["fields"].values():
            [vrml97(value) for value in values if isinstance(value, dict)]
        children = [vrml97(child) for child in node["children"]]
        name = {"Switch": "choice", "LOD": "level"}.get(node["class"])
        if name and children:
            node["fields"][name], node["children"] = children, []
    return node


def close():
    if browser:
        browser.stdin.close()
        browser.wait(30)
