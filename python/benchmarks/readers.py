"""Which Inventor, VRML 1.0 and VRML97 files of a folder ivcam, trimesh, PyVista and assimp open.

    python benchmarks/readers.py FOLDER [--json FILE]

Each reader runs in a process of its own, so that one that ends by a fault, or takes more than a
minute for a file, is counted as failing on that file alone. A reader opens a file if it returns
triangles; "with triangles" counts the files that any reader opens. Readers that are not installed
are left out. Prints a table in Markdown.
"""

import argparse
import gzip
import importlib.metadata
import json
import multiprocessing
import os
import pathlib
import sys
import warnings
from typing import Callable, Dict, List, Optional, Tuple

LANGUAGES = [
    (b"#Inventor V1.0 ascii", "Inventor ASCII"),
    (b"#Inventor V2.0 ascii", "Inventor ASCII"),
    (b"#Inventor V2.1 ascii", "Inventor ASCII"),
    (b"#Inventor V2.0 binary", "Inventor binary"),
    (b"#Inventor V2.1 binary", "Inventor binary"),
    (b"#VRML V1.0", "VRML 1.0"),
    (b"#VRML V2.0", "VRML97"),
]
SECONDS = 60


def language(path: pathlib.Path) -> Optional[str]:
    """Returns the language of a file by its first line; `None` for another file."""
    try:
        first = path.open("rb").read(64)
        if first[:2] == b"\x1f\x8b":
            first = gzip.open(path).read(64)
    except (OSError, EOFError):
        return None
    return next((name for start, name in LANGUAGES if first.startswith(start)), None)


def by_ivcam(path: str) -> int:
    import ivcam

    return len(ivcam.open(path).triangles().faces)


def by_trimesh(path: str) -> int:
    import trimesh

    return len(trimesh.load(path, force="mesh").faces)


def by_pyvista(path: str) -> int:
    import pyvista

    if not path.endswith((".wrl", ".vrml", ".wrl.gz")):
        return pyvista.read(path).triangulate().n_cells
    plotter = pyvista.Plotter(off_screen=True)
    plotter.import_vrml(path)
    count = 0
    for actor in plotter.renderer.GetActors():
        mapper = actor.GetMapper()
        if mapper is not None:
            mapper.Update()
            surface = pyvista.wrap(mapper.GetInput()).extract_surface(algorithm=None)
            count += surface.triangulate().n_cells
    return count


def by_pyassimp(path: str) -> int:
    import pyassimp

    flags = pyassimp.postprocess.aiProcess_Triangulate
    with pyassimp.load(path, processing=flags) as scene:
        return sum(len(mesh.faces) for mesh in scene.meshes)


def by_assimp_py(path: str) -> int:
    import assimp_py

    scene = assimp_py.import_file(path, assimp_py.Process_Triangulate)
    return sum(len(mesh.indices) // 3 for mesh in scene.meshes)


#: The readers, by the name of their package.
READERS: Dict[str, Callable[[str], int]] = {
    "ivcam": by_ivcam,
    "trimesh": by_trimesh,
    "pyvista": by_pyvista,
    "pyassimp": by_pyassimp,
    "assimp_py": by_assimp_py,
}


def serve(reader: str, pipe: "multiprocessing.connection.Connection") -> None:
    """Answers each path with its triangles, or with the text of what went wrong."""
    warnings.simplefilter("ignore")
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 1)
    os.dup2(nowhere, 2)
    while True:
        path = pipe.recv()
        try:
            pipe.send(READERS[reader](path))
        except BaseException as error:  # pyassimp's errors are no `Exception`.
            pipe.send(f"{type(error).__name__}: {error}"[:200])


class Reader:
    """A process that reads files, begun again when it has ended."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.process: Optional[multiprocessing.process.BaseProcess] = None

    def read(self, path: pathlib.Path) -> object:
        if self.process is None:
            self.pipe, theirs = multiprocessing.Pipe()
            context = multiprocessing.get_context("spawn")
            self.process = context.Process(target=serve, args=(self.name, theirs), daemon=True)
            self.process.start()
            theirs.close()
        self.pipe.send(str(path))
        try:
            if self.pipe.poll(SECONDS):
                return self.pipe.recv()
            problem = f"more than {SECONDS} seconds"
        except (EOFError, OSError):
            problem = "the process ended by a fault"
        self.process.kill()
        self.process.join()
        self.process = None
        return problem


def installed() -> Dict[str, str]:
    """Returns the versions of the readers that are installed."""
    found = {}
    for name in READERS:
        try:
            found[name] = importlib.metadata.version(name)
        except importlib.metadata.PackageNotFoundError:
            print(f"{name} is not installed and is left out", file=sys.stderr)
    return found


def table(names: List[str], results: List[Tuple[str, str, Dict[str, object]]]) -> None:
    """Prints how many files of each language each reader opens."""
    print("| language | files | with triangles | " + " | ".join(names) + " |")
    print("|---" * (3 + len(names)) + "|")
    languages = list(dict.fromkeys(name for _, name in LANGUAGES))
    for shown in [*languages, "all"]:
        rows = [found for _, name, found in results if shown in (name, "all")]
        full = [found for found in rows if any(map(is_open, found.values()))]
        counts = [str(sum(is_open(found[name]) for found in full)) for name in names]
        print(f"| {shown} | {len(rows)} | {len(full)} | " + " | ".join(counts) + " |")


def is_open(result: object) -> bool:
    return isinstance(result, int) and result > 0


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument(
        "--json", type=pathlib.Path, help="writes what each reader says of each file"
    )
    given = parser.parse_args()
    versions = installed()
    readers = {name: Reader(name) for name in versions}
    files = [(path, language(path)) for path in sorted(given.folder.rglob("*")) if path.is_file()]
    results: List[Tuple[str, str, Dict[str, object]]] = []
    for path, name in files:
        if name is not None:
            found = {reader: readers[reader].read(path) for reader in readers}
            results.append((str(path.relative_to(given.folder)), name, found))
    print(", ".join(f"{name} {version}" for name, version in versions.items()) + "\n")
    table(list(versions), results)
    for reader in versions:
        rest = [
            file
            for file, _, found in results
            if not is_open(found["ivcam"]) and is_open(found[reader])
        ]
        faults = [
            file for file, _, found in results if found[reader] == "the process ended by a fault"
        ]
        equal = sum(
            is_open(found["ivcam"]) and found[reader] == found["ivcam"] for _, _, found in results
        )
        print(
            f"\n{reader}: as many triangles as ivcam in {equal} files; opens {len(rest)} that ivcam "
            f"has no triangles of; ends by a fault in {len(faults)}"
        )
    if given.json:
        given.json.write_text(json.dumps(results, indent=1))


if __name__ == "__main__":
    main()
