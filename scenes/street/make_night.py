#!/usr/bin/env python3
"""Writes night.iv: a street after rain, for the shading model `path` and a fast lens.

Meters; y is up; the street runs along z, its middle is x = 0. Standard library only; the same script
writes the same bytes.
"""
import os
import sys
from math import pi

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, os.path.join(HERE, "..", "livroom"))
from meshes import at, cube, cylinder, group, indent, lathe, material, surface  # noqa: E402

CURB, PAVEMENT, HOUSES, FAR = 3.6, 0.12, 6.2, -72.0


def scattered(*key):
    """A number from 0 to 1 that looks random."""
    x = 0x9e3779b97f4a7c15
    for k in key:
        x = (x ^ (k + 0x7f4a7c15)) * 0xbf58476d1ce4e5b9 % 2 ** 64
        x ^= x >> 29
    return (x * 0x94d049bb133111eb % 2 ** 64) / 2 ** 64


def glow(r, g, b):
    return f"Material {{ diffuseColor 0 0 0  emissiveColor {r} {g} {b} }}"


def sphere(radius):
    return f"Sphere {{ radius {radius} }}"


def pane(x, y, z, wide, high, side):
    """A window that faces the street, as one face in the plane of constant x."""
    a, b = (z - wide / 2, z + wide / 2) if side < 0 else (z + wide / 2, z - wide / 2)
    points = ", ".join(f"{x:.3f} {q:.3f} {p:.3f}" for p, q in ((b, y), (a, y), (a, y + high), (b, y + high)))
    return (f"Coordinate3 {{ point [ {points} ] }}\nIndexedFaceSet {{ coordIndex [ 0,1,2,3,-1 ] }}")


def ground():
    """Wet asphalt and wet flagstones, with a curb."""
    length, middle = 8 - FAR, (8 + FAR) / 2
    wet = "specularColor 0.24 0.24 0.25  shininess"
    parts = [f"Material {{ diffuseColor 0.22 0.22 0.23  {wet} 0.8 }}",
             at(0, -0.05, middle, cube(2 * CURB, 0.1, length)),
             f"Material {{ diffuseColor 0.36 0.34 0.33  {wet} 0.35 }}"]
    for side in (-1, 1):
        parts.append(at(side * (CURB + HOUSES) / 2, PAVEMENT / 2, middle, cube(HOUSES - CURB, PAVEMENT, length)))
    return group("GROUND", *parts)


WALLS = [(0.46, 0.33, 0.27), (0.52, 0.47, 0.40), (0.38, 0.36, 0.36), (0.56, 0.44, 0.32), (0.42, 0.40, 0.34)]
LIGHTS = [(1.0, 0.80, 0.50), (1.0, 0.86, 0.62), (0.95, 0.70, 0.40), (0.72, 0.86, 1.0)]


def house(number, side, z):
    """A house of four floors, 8 m wide: a shop below, and windows of which some are lit."""
    x = side * HOUSES
    front = x - side * 0.03
    wall = WALLS[int(len(WALLS) * scattered(number, side + 5))]
    high = 11.5 + 3 * scattered(number, side + 9)
    parts = [material(wall), at(x + side * 2, high / 2, z, cube(4, high, 7.98))]
    dark = ["Material { diffuseColor 0.05 0.06 0.08  specularColor 0.2 0.2 0.2  shininess 0.9 }"]
    for floor in range(3):
        for k in range(3):
            place = (front, 4.3 + 2.9 * floor, z + 2.5 * (k - 1))
            if scattered(number, side + 20, floor, k) < 0.34:
                color = LIGHTS[int(len(LIGHTS) * scattered(number, side + 30, floor, k))]
                level = 0.35 + 0.45 * scattered(number, side + 40, floor, k)
                lit = [f"{c * level:.3f}" for c in color]
                parts.append("Separator {\n" + indent(f"{glow(*lit)}\n{pane(*place, 1.05, 1.6, side)}") + "\n}")
            else:
                dark.append("Separator {\n" + indent(pane(*place, 1.05, 1.6, side)) + "\n}")
    parts.append("Separator {\n" + indent("\n".join(dark)) + "\n}")
    if number == 0 or scattered(number, side + 50) < 0.62:
        color = LIGHTS[number % 3]
        lit = [f"{c * 0.66:.3f}" for c in color]
        parts.append("Separator {\n" + indent(f"{glow(*lit)}\n{pane(front, 0.75, z, 5.6, 2.0, side)}") + "\n}")
        cloth = [(0.45, 0.08, 0.07), (0.08, 0.22, 0.20), (0.10, 0.14, 0.30)][number % 3]
        parts.append(material(cloth))
        parts.append(at(front - side * 0.55, 2.95, z, cube(1.2, 0.05, 6.2), turn=((0, 0, 1), side * 0.42)))
    return "Separator {\n" + indent("\n".join(parts)) + "\n}"


def lamp(x, z):
    """A post with a globe. The light is the globe's center, which its culled back lets out."""
    toward = 1 if x < 0 else -1
    return (at(x, PAVEMENT, z,
               at(0, 1.9, 0, cylinder(0.045, 3.8)), at(0, 0.3, 0, cylinder(0.09, 0.6)),
               at(toward * 0.25, 3.78, 0, cube(0.55, 0.04, 0.04))))


def globe(x, z):
    toward = 1 if x < 0 else -1
    return at(x + toward * 0.5, PAVEMENT + 3.62, z, sphere(0.17))


def light(x, z):
    toward = 1 if x < 0 else -1
    return (f"PointLight {{ location {x + toward * 0.5:.2f} {PAVEMENT + 3.62:.2f} {z}  color 1 0.86 0.66  intensity 0.62 }}")


LAMPS = [(side * 4.1, z) for z in (7.0, -4.0, -16.0, -28.0, -40.0, -52.0, -64.0) for side in (-1, 1)]


def cup():
    outside = lathe([(0, 0), (0.022, 0), (0.024, 0.004), (0.034, 0.020), (0.041, 0.045), (0.043, 0.062),
                     (0.041, 0.062), (0.039, 0.045), (0.031, 0.020), (0, 0.012)], 48)
    saucer = lathe([(0, 0.004), (0.035, 0.004), (0.060, 0.012), (0.072, 0.016), (0.072, 0.013), (0.036, 0), (0, 0)], 48)
    china = material((0.93, 0.92, 0.88), 0.04, 0.9)
    handle = [at(0.056, 0.036, 0, cube(0.005, 0.026, 0.007))]
    handle += [at(0.047, y, 0, cube(0.020, 0.005, 0.007)) for y in (0.023, 0.049)]
    coffee = "Material { diffuseColor 0.10 0.05 0.03  specularColor 0.15 0.15 0.15  shininess 1 }"
    return group("CUP", china, surface(saucer, 0.5),
                 at(0, 0.008, 0, surface(outside, 0.7), *handle, turn=((0, 1, 0), 0.6)),
                 coffee, at(0, 0.058, 0, cylinder(0.039, 0.002)))


def lantern():
    """A candle in a glass, whose flame is small, bright and in focus."""
    wax = "Material { diffuseColor 0.9 0.82 0.66  emissiveColor 0.42 0.22 0.07 }"
    glass = ("Material { diffuseColor 0.02 0.02 0.02  specularColor 0.2 0.2 0.2  shininess 1  transparency 0.9 }")
    side = lathe([(0.042, 0.003), (0.046, 0.05), (0.043, 0.105), (0.0415, 0.105), (0.0445, 0.05), (0.0405, 0.003)], 48)
    foot = material((0.30, 0.26, 0.20), 0.3, 0.6)
    return group("LANTERN", foot, at(0, 0.0025, 0, cylinder(0.05, 0.005)),
                 wax, at(0, 0.03, 0, cylinder(0.026, 0.05)),
                 glow(3.6, 2.5, 1.3), "Separator { ShapeHints { vertexOrdering COUNTERCLOCKWISE  shapeType SOLID } Transform { translation 0 0.073 0  scaleFactor 1 2.6 1 } " + sphere(0.0055) + " }",
                 glass, surface(side, 0.5))


def table():
    iron = material((0.14, 0.15, 0.15), 0.2, 0.5)
    stone = material((0.58, 0.55, 0.52), 0.05, 0.75)
    return group("TABLE", iron, at(0, 0.36, 0, cylinder(0.022, 0.70)), at(0, 0.012, 0, cylinder(0.19, 0.024)),
                 at(0, 0.70, 0, cylinder(0.29, 0.02)), stone, at(0, 0.725, 0, cylinder(0.30, 0.026)))


def chair():
    """A folding chair: four tubes and slats."""
    iron = material((0.12, 0.20, 0.17), 0.2, 0.5)
    parts = [iron]
    for x in (-0.18, 0.18):
        parts += [at(x, 0.45, 0.17, cylinder(0.010, 0.90)), at(x, 0.22, -0.17, cylinder(0.010, 0.44))]
    parts += [at(0, 0.45, 0.13 - 0.085 * k, cube(0.40, 0.012, 0.07)) for k in range(5)]
    parts += [at(0, 0.66 + 0.11 * k, 0.17, cube(0.36, 0.06, 0.012)) for k in range(3)]
    return group("CHAIR", *parts)


def night():
    lamps = [light(x, z) for x, z in LAMPS]
    houses = [house(k, side, 4.0 - 8.0 * k) for k in range(10) for side in (-1, 1)]
    cars = []
    for k, (x, z) in enumerate([(1.5, -19.0), (1.7, -34.0), (-1.6, -27.0), (-1.5, -45.0)]):
        color = (2.4, 0.25, 0.12) if x > 0 else (2.2, 2.1, 1.8)
        body = material([(0.12, 0.13, 0.16), (0.30, 0.08, 0.07), (0.20, 0.21, 0.22), (0.10, 0.16, 0.14)][k], 0.08, 0.8)
        back = 2.12
        cars.append(at(x, 0, z, body, at(0, 0.62, 0, cube(1.7, 0.65, 4.2)), at(0, 1.15, 0.1, cube(1.5, 0.55, 2.2)),
                       glow(*color), at(-0.62, 0.68, back, cylinder(0.09, 0.03), turn=((1, 0, 0), pi / 2)),
                       at(0.62, 0.68, back, cylinder(0.09, 0.03), turn=((1, 0, 0), pi / 2))))
    cord = []
    for row, z in enumerate((-11.0, -21.0)):
        for k in range(13):
            u = k / 6 - 1
            color = [(2.0, 1.55, 0.95), (2.0, 0.6, 0.35), (0.7, 1.6, 1.1), (1.1, 1.3, 2.0)][(k + row) % 4]
            cord.append(at(u * (HOUSES - 0.2), 3.3 + 1.0 * u * u, z, glow(*color), sphere(0.055)))
    top = PAVEMENT + 0.738
    set_table = at(4.62, 0, 0.35, at(0, PAVEMENT, 0, table()),
                   at(0.08, top, -0.02, cup()), at(-0.12, top, 0.07, lantern()))
    flame = f"PointLight {{ location 4.5 {top + 0.073:.3f} 0.42  color 1 0.72 0.40  intensity 0.012 }}"
    others = [at(4.9, 0, -2.3, at(0, PAVEMENT, 0, table()), at(0, top, 0, lantern())),
              at(4.75, 0, -5.2, at(0, PAVEMENT, 0, table()), at(0, top, 0, lantern()))]
    chairs = [at(5.25, PAVEMENT, -2.6, chair(), turn=((0, 1, 0), 2.0))]
    camera = ("DEF AT_THE_TABLE PerspectiveCamera {\n  position 4.72 1.12 2.20\n  orientation -0.18136 0.98336 0.01030 0.11536\n  nearDistance 0.05\n"
              "  farDistance 120\n  heightAngle 0.33\n  focalDistance 1.85\n}")
    solid = "ShapeHints { vertexOrdering COUNTERCLOCKWISE  shapeType SOLID  creaseAngle 0.6 }"
    return group("NIGHT", camera,
                 "# The glow of the town in the clouds, and light that fades with the square of the distance.",
                 "Environment { ambientIntensity 0.055  ambientColor 0.55 0.70 1  attenuation 1 0 0 }",
                 group("STREET_LAMPS", *lamps, kind="Group"),
                 ground(), group("HOUSES", *houses), group("CARS", *cars),
                 group("POSTS", material((0.10, 0.12, 0.12), 0.1, 0.5), *(lamp(x, z) for x, z in LAMPS)),
                 group("GLOBES", solid, glow(2.0, 1.75, 1.35), *(globe(x, z) for x, z in LAMPS)),
                 group("CORDS_OF_BULBS", *cord),
                 "# The flame lights the table only.", group("CAFE", flame, set_table, *chairs, *others))


HEAD = """#Inventor V2.1 ascii
#
# A street after rain, at night: a table of a cafe in focus, and behind it lamps, windows and
# cars. For the shading model `path` through a fast lens. Meters; y is up; the street runs along
# -z. Made by make_night.py; own modelling.

"""


def main():
    with open(os.path.join(HERE, "night.iv"), "w", encoding="ascii") as file:
        file.write(HEAD + night() + "\n")


if __name__ == "__main__":
    main()
