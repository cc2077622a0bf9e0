"""The scenes of `path_speed.py`: triangles of matte and luminous colors, so that all programs have
the same.

Numbers are meters and linear light; +y is up. A scene is written as Inventor, and the programs'
exports of that file are what the others read. Its colors are encoded there as sRGB, which model
`path` and the exports decode.
"""

import json
import math
import os
import struct
import subprocess
from dataclasses import dataclass, field

import numpy as np

SCENES = ("living room", "Cornell room", "studio")
ROOT = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "scenes")


@dataclass
class Part:
    """Triangles of one color. The emission is a radiance."""
    color: tuple
    emission: tuple
    points: np.ndarray
    faces: np.ndarray


@dataclass
class Camera:
    """A camera as Inventor states it, and the distance that the lens is focused at."""
    position: tuple
    axis: tuple
    angle: float
    height_angle: float
    focus: float


@dataclass
class Scene:
    parts: list
    camera: Camera
    # Spot lights as `ivcam check --json` lists them; their light falls by the square of the distance.
    lights: list = field(default_factory=list)

    def triangles(self):
        return sum(len(part.faces) for part in self.parts)


def decoded(level):
    level = np.asarray(level, dtype=float)
    return np.where(level <= 0.04045, level / 12.92, ((level + 0.055) / 1.055) ** 2.4)


def encoded(light):
    light = np.asarray(light, dtype=float)
    return np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)


def box(low, high, color, emission=(0, 0, 0)):
    """A box whose faces look out."""
    points = np.array([[(low, high)[k >> axis & 1][axis] for axis in range(3)] for k in range(8)], dtype=float)
    quads = [(0, 4, 6, 2), (1, 3, 7, 5), (0, 1, 5, 4), (2, 6, 7, 3), (0, 2, 3, 1), (4, 5, 7, 6)]
    faces = np.array([corner for a, b, c, d in quads for corner in ((a, b, c), (a, c, d))])
    return Part(tuple(color), tuple(emission), points, faces)


def ball(center, radius, color, rows, columns):
    down, along = np.meshgrid(np.linspace(0, math.pi, rows + 1), np.arange(columns) * math.tau / columns, indexing="ij")
    around = np.stack([np.sin(down) * np.sin(along), np.cos(down), np.sin(down) * np.cos(along)], axis=-1)
    faces = []
    for row in range(rows):
        for column in range(columns):
            a, b = row * columns + column, row * columns + (column + 1) % columns
            faces += [(a, a + columns, b + columns)] * (row < rows - 1) + [(a, b + columns, b)] * (row > 0)
    return Part(tuple(color), (0, 0, 0), np.array(center) + radius * around.reshape(-1, 3), np.array(faces))


def moved(part, turn, to):
    """Turns a part around the y axis, in radians, and moves it."""
    c, s = math.cos(turn), math.sin(turn)
    part.points = part.points @ np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]]).T + np.array(to)
    return part


def joined(parts):
    """One part for each color."""
    groups = {}
    for part in parts:
        groups.setdefault((part.color, part.emission), []).append(part)
    made = []
    for (color, emission), group in groups.items():
        starts = np.cumsum([0] + [len(part.points) for part in group[:-1]])
        faces = np.concatenate([part.faces + start for part, start in zip(group, starts)])
        made.append(Part(color, emission, np.concatenate([part.points for part in group]), faces))
    return made


def read_glb(path):
    """The triangles of a file in world space. Textures are left out, and surfaces that are not opaque."""
    with open(path, "rb") as file:
        data = file.read()
    length = struct.unpack_from("<I", data, 12)[0]
    root, binary = json.loads(data[20:20 + length]), data[28 + length:]
    kinds = {5121: np.uint8, 5123: np.uint16, 5125: np.uint32, 5126: np.float32}

    def values(index):
        accessor = root["accessors"][index]
        view = root["bufferViews"][accessor["bufferView"]]
        start = view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
        width = {"SCALAR": 1, "VEC3": 3}[accessor["type"]]
        assert "byteStride" not in view or view["byteStride"] == 4 * width, "interleaved data are not read"
        return np.frombuffer(binary, kinds[accessor["componentType"]], accessor["count"] * width, start).reshape(-1, width)

    parts = []

    def visit(index, above):
        node = root["nodes"][index]
        here = above @ placed(node)
        for primitive in root["meshes"][node["mesh"]]["primitives"] if "mesh" in node else []:
            look = surface(root["materials"][primitive["material"]])
            if primitive.get("mode", 4) == 4 and look:
                points = values(primitive["attributes"]["POSITION"]) @ here[:3, :3].T + here[:3, 3]
                parts.append(Part(*look, points, values(primitive["indices"]).reshape(-1, 3).astype(int)))
        for child in node.get("children", []):
            visit(child, here)

    for index in root["scenes"][root.get("scene", 0)]["nodes"]:
        visit(index, np.eye(4))
    return joined(parts)


def placed(node):
    if "matrix" in node:
        return np.array(node["matrix"]).reshape(4, 4).T
    x, y, z, w = node.get("rotation", (0, 0, 0, 1))
    made = np.eye(4)
    made[:3, :3] = np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]]) * node.get("scale", (1, 1, 1))
    made[:3, 3] = node.get("translation", (0, 0, 0))
    return made


def surface(material):
    """Color and emission of a material, or nothing if it is not opaque."""
    if material.get("alphaMode", "OPAQUE") == "BLEND":
        return None
    extensions = material.get("extensions", {})
    color = tuple(material["pbrMetallicRoughness"].get("baseColorFactor", (1, 1, 1, 1))[:3])
    if "KHR_materials_unlit" in extensions:
        return (0.0, 0.0, 0.0), color
    strength = extensions.get("KHR_materials_emissive_strength", {}).get("emissiveStrength", 1)
    return color, tuple(strength * value for value in material.get("emissiveFactor", (0, 0, 0)))


def exported(program, path, folder):
    output = os.path.join(folder, "exported.glb")
    subprocess.run([program, "convert", path, "--force", "-o", output], check=True, stderr=subprocess.DEVNULL)
    return read_glb(output)


def living_room(program, folder):
    path = os.path.join(ROOT, "livroom", "evening.iv")
    found = json.loads(subprocess.run([program, "check", "--json", path], check=True, capture_output=True).stdout)
    camera = found["camera"]
    turn = camera["orientation"]
    return Scene(exported(program, path, folder), Camera(
        camera["position"], turn["axis"], turn["angle"], camera["heightAngle"], camera["focalDistance"]), found["lights"])


def cornell_room(_program, _folder):
    """A room of 1.8 x 1.2 x 1.2 m, open toward the camera, with 62 balls: 125,560 triangles."""
    random = np.random.default_rng(1)
    white, wide = (0.74, 0.74, 0.74), (0.9, 0.6, 0.6)
    parts = [
        box((-1, -0.7, -0.7), (1, -0.6, 0.6), white), box((-1, 0.6, -0.7), (1, 0.7, 0.6), white),
        box((-1, -0.6, -0.7), (1, 0.6, -0.6), white), box((-1, -0.6, -0.6), (-0.9, 0.6, 0.6), (0.63, 0.06, 0.05)),
        box((0.9, -0.6, -0.6), (1, 0.6, 0.6), (0.14, 0.45, 0.09)),
        box((-0.25, 0.595, -0.25), (0.25, 0.605, 0.25), (0, 0, 0), (9, 7.5, 5))]
    colors = [(0.7, 0.6, 0.4), (0.3, 0.4, 0.6), (0.6, 0.3, 0.3), (0.4, 0.6, 0.5), (0.75, 0.75, 0.7)]
    for k in range(62):
        radius = random.uniform(0.04, 0.12)
        x, y, z = (random.uniform(radius - w, w - radius) for w in wide)
        height = -0.6 + radius if k % 2 else y * 0.8
        parts.append(ball((x, height, z), radius, colors[k % 5], 24, 44))
    return Scene(joined(parts), Camera((0, 0, 2.9), (0, 0, 1), 0.0, 0.471, 2.9))


def studio(program, folder):
    """The telephone of the living room on paper, under a large key lamp and a small one."""
    parts = exported(program, os.path.join(ROOT, "livroom", "telephone.iv"), folder)
    parts += [
        box((-2, -0.02, -0.8), (2, 0, 1.6), (0.75, 0.75, 0.75)), box((-2, 0, -0.82), (2, 1.6, -0.8), (0.75, 0.75, 0.75)),
        moved(box((-0.3, -0.3, -0.01), (0.3, 0.3, 0.01), (0, 0, 0), (7, 6.8, 6.4)), 0.8, (0.6, 0.75, 0.6)),
        moved(box((-0.1, -0.1, -0.01), (0.1, 0.1, 0.01), (0, 0, 0), (6, 6.6, 8)), -1.0, (-0.9, 0.45, 0.4))]
    return Scene(joined(parts), Camera((0, 0.34, 0.78), (1, 0, 0), -0.36, 0.471, 0.8))


def make(name, program, folder):
    return {SCENES[0]: living_room, SCENES[1]: cornell_room, SCENES[2]: studio}[name](program, folder)


def words(values, digits=7):
    return " ".join(f"{value:.{digits}g}" for value in values)


def inventor(scene):
    camera = scene.camera
    lines = ["#Inventor V2.1 ascii",
             f"PerspectiveCamera {{ position {words(camera.position)} orientation {words(camera.axis)} {camera.angle:.7g} "
             f"heightAngle {camera.height_angle:.7g} focalDistance {camera.focus:.7g} }}",
             "Environment { ambientIntensity 0 attenuation 1 0 0 }", "ShapeHints { creaseAngle 0 }"]
    for light in scene.lights:
        assert light["type"] == "SpotLight" and light["dropOffRate"] == 0
        lines.append(f"SpotLight {{ location {words(light['location'])} direction {words(light['direction'])} color "
                     f"{words(light['color'])} intensity {light['intensity']} dropOffRate 0 cutOffAngle {light['cutOffAngle']} }}")
    for part in scene.parts:
        faces = ",".join(f"{a},{b},{c},-1" for a, b, c in part.faces)
        points = ",".join(words(point, 9) for point in part.points)
        lines.append(f"Separator {{ Material {{ ambientColor 0 0 0 diffuseColor {words(encoded(part.color))} emissiveColor "
                     f"{words(encoded(part.emission))} }}\nCoordinate3 {{ point [ {points} ] }}\n"
                     f"IndexedFaceSet {{ coordIndex [ {faces} ] }} }}")
    return "\n".join(lines) + "\n"
