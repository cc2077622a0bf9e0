"""VTK's importer of VRML97, by the Python package `vtk`: each file in a process of its own, as some end it."""

import json
import sys

from adapters.support import run
from run import Refused

READS = ["vrml97"]
GIVES = ["box", "triangles"]
SCRIPT = """
import json, sys, vtk
reader, window = vtk.vtkVRMLImporter(), vtk.vtkRenderWindow()
window.SetOffScreenRendering(1)
reader.SetFileName(sys.argv[1])
reader.SetRenderWindow(window)
reader.Update()
count, box, actors = 0, vtk.vtkBoundingBox(), reader.GetRenderer().GetActors()
for actor in list(actors):
    data = actor.GetMapper().GetInput() or actor.GetMapper().GetInputDataObject(0, 0)
    actor.GetMapper().Update()
    triangles = vtk.vtkTriangleFilter()
    triangles.SetInputData(actor.GetMapper().GetInput())
    triangles.Update()
    count += triangles.GetOutput().GetNumberOfPolys()
    box.AddBounds(actor.GetBounds())
low, high = [0] * 3, [0] * 3
if box.IsValid():
    box.GetMinPoint(low), box.GetMaxPoint(high)
print(json.dumps({"box": {"min": low, "max": high} if box.IsValid() else None, "triangles": count}))
"""


def version():
    return "VTK " + run(sys.executable, "-c", "import vtk; print(vtk.vtkVersion().GetVTKVersion())").stdout.strip()


def read(path, kinds, size, time, folder):
    done = run(sys.executable, "-c", SCRIPT, path)
    if done.returncode or "{" not in done.stdout:
        raise Refused(f"code {done.returncode} {done.stderr.strip()[-150:]}")
    return json.loads(done.stdout[done.stdout.index("{"):])
