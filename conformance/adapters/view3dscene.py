"""view3dscene, with `tovrmlx3d` for the tree. Pictures need an X server in DISPLAY, such as Xvfb."""

import os
import shutil

from adapters.support import png, run
from run import Refused
from scene_text import roots

READS = ["inventor-1.0", "vrml-1.0", "vrml97"]
GIVES = ["tree", "messages"] + (["picture"] if os.environ.get("DISPLAY") else [])


def version():
    return "view3dscene " + run("view3dscene", "--version").stdout.strip()


def read(path, kinds, size, time, folder):
    done = run("tovrmlx3d", path)
    if "Exception" in done.stdout or not done.stdout:
        raise Refused(done.stderr.strip() or "nothing is written")
    said = [line for line in done.stderr.splitlines() if line.strip()]
    answer = {"messages": said, "tree": roots(done.stdout)}
    if "picture" in kinds:
        run("view3dscene", "--geometry", "{}x{}".format(*size), "--hide-extras", "--hide-menu", "--screenshot", 0,
            folder / "view.png", copy(path, folder))
        answer["picture"] = png(folder / "view.png")
    return answer


def copy(path, folder):
    """Returns a copy of a file on black ground, and without a headlight where its language has no word for that."""
    text, added = path.read_text(encoding="utf-8"), ""
    if "vrml97" not in path.parts:
        added += "NavigationInfo { headlight FALSE }\n"
    if "Background" not in text and "environment" not in path.parts:
        added += "Background { skyColor 0 0 0 }\n"
    for helper in path.parent.glob("_*"):
        shutil.copy(helper, folder)
    (folder / path.name).write_text(f"{text}\n{added}", encoding="utf-8")
    return folder / path.name
