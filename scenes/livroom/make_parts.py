#!/usr/bin/env python3
"""Makes the parts and textures of the living room: run it here, then look at livroom.iv.

Every part is an Inventor file in meters with its own origin on the floor (or the table top) under its
middle; livroom.iv, which is written by hand, puts them in place. Same script, same bytes.
"""
import os
import sys
from math import cos, hypot, pi, sin, sqrt

from meshes import *
from pictures import *

HERE = os.path.dirname(os.path.abspath(__file__))
TOTALS = {}


def write_part(name, about, *nodes):
    """Writes one .iv file: header, what it is, one root Separator."""
    lines = ["#Inventor V2.1 ascii", "#"] + ["# " + line for line in about.strip().split("\n")]
    lines.append("# Made by make_parts.py; own modelling.")
    text = "\n".join(lines) + "\n\n" + group(name.upper().replace("-", "_"), *nodes) + "\n"
    with open(os.path.join(HERE, name + ".iv"), "w", encoding="ascii") as out:
        out.write(text)
    TOTALS[name] = len(text)


def paint(name, width, height, pixel, step=4):
    write_png(os.path.join(HERE, name), width, height, pixel, step)


# Materials that several parts share. A specular color is also what a recursive shader mirrors.
BLACK = material((0.055, 0.052, 0.055), 0.22, 0.55)
BRASS = material((0.40, 0.30, 0.14), (0.42, 0.35, 0.21), 0.5)
WHITE_PAINT = material((0.80, 0.79, 0.76), 0.03, 0.2)


# ---- the room ----

ROOM = dict(x0=-2.7, x1=1.8, z0=-2.6, z1=3.0, height=2.6, hall=12.6)


def flat_grid(corner, along, up, columns, rows, scale):
    """A rectangle as a QuadMesh fine enough for lighting at vertices; texture in units of `scale` meters."""
    w, h = sqrt(dot(along, along)), sqrt(dot(up, up))
    mesh = sheet(rows, columns, lambda u, v: add(corner, add(times(along, u), times(up, v))))
    mesh.uv = [(u * w / scale[0], v * h / scale[1]) for u, v in mesh.uv]
    return quad_mesh(rows, columns, mesh)


def wall_with_holes(x, z_from, z_to, height, holes):
    """A wall in the plane x, facing +x, as rectangles around windows (z0, z1, y0, y1)."""
    cuts_z = sorted({z_from, z_to, *(h[0] for h in holes), *(h[1] for h in holes)})
    cuts_y = sorted({0.0, height, *(h[2] for h in holes), *(h[3] for h in holes)})
    pieces = []
    for a, b in zip(cuts_z, cuts_z[1:]):
        for c, d in zip(cuts_y, cuts_y[1:]):
            if any(h[0] <= a and b <= h[1] and h[2] <= c and d <= h[3] for h in holes):
                continue
            n, m = max(2, round((b - a) / 0.25) + 1), max(2, round((d - c) / 0.25) + 1)
            mesh = sheet(m, n, lambda u, v: (x, c + (d - c) * v, b + (a - b) * u))
            mesh.uv = [(-(b + (a - b) * u) / 0.6, (c + (d - c) * v) / 0.6) for u, v in mesh.uv]
            pieces.append(group(None, quad_mesh(m, n, mesh)))
    return pieces


WINDOWS = [(0.62, 2.12, 0.70, 2.25), (-1.85, -0.35, 0.70, 2.25)]


def room():
    r = ROOM
    x0, x1, z0, z1, top, hall = (r[k] for k in ("x0", "x1", "z0", "z1", "height", "hall"))
    wide, deep = x1 - x0, z1 - z0
    wallpaper = group("WALLPAPER", material((0.77, 0.71, 0.60)), texture("wallpaper.png"), hints(0),
                      group("BACK_WALL", flat_grid((x0, 0, z0), (wide, 0, 0), (0, top, 0), 19, 11, (0.6, 0.6))),
                      group("RIGHT_WALL", flat_grid((x1, 0, z0), (0, 0, deep), (0, top, 0), 23, 11, (0.6, 0.6))),
                      group("LEFT_WALL", *wall_with_holes(x0, z0, z1, top, WINDOWS)))
    floor_part = group("FLOOR", material((0.76, 0.49, 0.25), 0.05, 0.4), texture("floor.png"), hints(0),
                       flat_grid((x0, 0, z1), (wide, 0, 0), (0, 0, -deep), 19, 23, (1.2, 1.2)),
                       group(None, flat_grid((x0, 0, hall), (wide, 0, 0), (0, 0, z1 - hall), 7, 13, (1.2, 1.2))))
    ceiling = group("CEILING", material((0.83, 0.82, 0.79)), hints(0),
                    flat_grid((x0, top, z0), (wide, 0, 0), (0, 0, deep), 13, 15, (1, 1)))
    opening = (-1.5, 1.5, 2.2)
    front = group("FRONT_WALL", material((0.80, 0.76, 0.68)),
                  block(x0, opening[0], 0, top, z1, z1 + 0.15), block(opening[1], x1, 0, top, z1, z1 + 0.15),
                  block(opening[0], opening[1], opening[2], top, z1, z1 + 0.15))
    hall_part = group("HALL", material((0.74, 0.71, 0.65)), hints(0),
                      group(None, flat_grid((x0, 0, hall), (0, 0, z1 - hall), (0, top, 0), 9, 3, (1, 1))),
                      group(None, flat_grid((x1, 0, z1), (0, 0, hall - z1), (0, top, 0), 9, 3, (1, 1))),
                      group(None, flat_grid((x1, 0, hall), (-wide, 0, 0), (0, top, 0), 3, 3, (1, 1))),
                      group(None, flat_grid((x0, top, z1), (wide, 0, 0), (0, 0, hall - z1), 3, 9, (1, 1))))
    write_part("room", f"""The empty room: floor, walls, ceiling, skirting, cornice, and the hall behind the camera.
{wide} m wide (x {x0} to {x1}), {deep} m deep (z {z0} to {z1}), {top} m high; the hall runs on to z = {hall},
so that the long lenses have room to stand back. Two window openings in the left wall.""",
               wallpaper, floor_part, ceiling, front, hall_part, skirting(), cornice())


def skirting():
    """Skirting boards 110 mm high with a rounded top, 16 mm thick."""
    r = ROOM
    section = [(0, 0), (0.016, 0), (0.016, 0.085), (0.013, 0.095), (0.008, 0.100), (0.006, 0.108), (0, 0.110)]

    def run(x, z, length, angle):
        board = extrude(section, 0, length)
        return surface(board.turned("y", angle).moved(x, 0, z), 0.5, concave=True)
    deep = r["z1"] - r["z0"]
    return group("SKIRTING", WHITE_PAINT,
                 run(r["x0"], r["z0"], deep, 0), run(r["x1"], r["z1"], deep, pi),
                 run(r["x1"], r["z0"], r["x1"] - r["x0"], -pi / 2))


def cornice():
    """A plaster cornice, 90 mm down the wall and along the ceiling: a cove between two fillets."""
    r = ROOM
    cove = [(0.012 + 0.066 * (1 - cos(a)), 0.012 + 0.066 * (1 - sin(a))) for a in (pi / 2 * k / 8 for k in range(9))]
    section = [(0, 0), (0, 0.090), (0.012, 0.090)] + [(x, y) for x, y in cove] + [(0.090, 0.012), (0.090, 0)]
    section = [(x, r["height"] - y) for x, y in section]

    def run(x, z, length, angle):
        return surface(extrude(section, 0, length).turned("y", angle).moved(x, 0, z), 0.5, concave=True)
    deep = r["z1"] - r["z0"]
    return group("CORNICE", WHITE_PAINT,
                 run(r["x0"], r["z0"], deep, 0), run(r["x1"], r["z1"], deep, pi),
                 run(r["x1"], r["z0"], r["x1"] - r["x0"], -pi / 2))


def window():
    """One sash window; its origin is the middle of the opening's foot on the inner wall face."""
    wide, high, deep = 1.5, 1.55, 0.16
    bar, w2 = 0.05, wide / 2
    parts = [WHITE_PAINT]
    for z in (-w2, w2):
        parts.append(block(-deep, 0.02, 0, high, z - 0.02, z + 0.02))                      # reveal and lining
        parts.append(block(0.0, 0.022, -0.09, high + 0.09, z - (0.09 if z < 0 else -0.02), z + (0.09 if z > 0 else -0.02)))
    parts.append(block(-deep, 0.0, high - 0.02, high, -w2, w2))
    parts.append(block(0, 0.022, high, high + 0.09, -w2 - 0.09, w2 + 0.09))
    parts.append(block(-deep, 0.08, -0.035, 0.0, -w2 - 0.06, w2 + 0.06))                   # sill
    for z in (-w2 + 0.045, 0, w2 - 0.045):
        parts.append(block(-0.12, -0.08, 0, high - 0.02, z - bar / 2, z + bar / 2))
    for y in (0.03, high - 0.045):
        parts.append(block(-0.12, -0.08, y - 0.03, y + 0.025, -w2 + 0.02, w2 - 0.02))
    for k in (1, 2):
        y = high * k / 3
        parts.append(block(-0.11, -0.09, y - 0.011, y + 0.011, -w2 + 0.02, w2 - 0.02))
    pane = Mesh([(-0.1, 0, w2), (-0.1, 0, -w2), (-0.1, high, -w2), (-0.1, high, w2)], [(0, 1, 2, 3)])
    write_part("window", """One casement window, opening 1.5 m wide and 1.55 m high; the wall is in the plane x = 0, outside is -x.
Origin: the middle of the foot of the opening. Frame, glazing bars, sill, architrave, and one pane of glass.""",
               group("FRAME", *parts),
               surface(pane, 0, 4, "GLASS", material((0.02, 0.03, 0.03), 0.08, 0.9, transparency=0.92)))


# ---- the coffee table ----

TABLE = dict(long=1.34, wide=0.74, top=0.42, pitch=0.15)


def table():
    t = TABLE
    lx, lz, rail, h = t["wide"] / 2, t["long"] / 2, 0.068, 0.045
    wood = [material((0.56, 0.32, 0.17), 0.07, 0.5), texture("walnut.png")]

    def board(size, place, grain):
        m = rounded_box(size, 0.004, 2)
        k = {"x": 0, "z": 2, "y": 1}[grain]
        other = [i for i in range(3) if i != k]
        m.uv = [(p[k] / 0.5 + place[2] * 1.7 + place[0], (p[other[0]] + p[other[1]]) / 0.16 + 0.37 * place[0]) for p in m.points]
        return surface(m.moved(*place), 0.5)
    parts = []
    y = t["top"] - 0.003 - h / 2
    for s in (-1, 1):
        parts.append(board((rail, h, 2 * lz), (s * (lx - rail / 2), y, 0), "z"))
        parts.append(board((2 * lx - 2 * rail, h, rail), (0, y, s * (lz - rail / 2)), "x"))
        parts.append(board((0.022, 0.07, 2 * lz - 0.16), (s * (lx - 0.04), y - h / 2 - 0.035, 0), "z"))
        parts.append(board((2 * lx - 0.16, 0.07, 0.022), (0, y - h / 2 - 0.035, s * (lz - 0.04)), "x"))
    leg = loft([[(x, yy, z) for x, z in rounded_rectangle(w, w, 0.008, 3)] for yy, w in
                ((0, 0.030), (0.004, 0.034), (0.20, 0.046), (t["top"] - 0.05, 0.056))])
    leg.uv = [(p[1] / 0.5, (p[0] + p[2]) / 0.16) for p in leg.points]
    legs = [at(sx * (lx - 0.045), 0, sz * (lz - 0.045), surface(leg, 0.5)) for sx in (-1, 1) for sz in (-1, 1)]
    tile = rounded_box((0.1472, 0.008, 0.1472), 0.0016, 2)
    tile.uv = [(p[0] / t["pitch"] + 0.5, p[2] / t["pitch"] + 0.5) for p in tile.points]
    tiles = []
    for i in range(8):
        for j in range(4):
            x, z = (j - 1.5) * t["pitch"], (i - 3.5) * t["pitch"]
            shade = 0.93 + 0.07 * hashed(i, j, 5)
            face, glaze = (("tile-a.png", (0.25, 0.52, 0.54)) if (i + j) % 2 else ("tile-b.png", (0.92, 0.89, 0.80)))
            shape = "USE TILE" if tiles else surface(tile, 0.5, 5, "TILE")
            tiles.append(group(None, material(times(glaze, shade), 0.14, 0.8), texture(face),
                               f"Texture2Transform {{ center 0.5 0.5 rotation {number(pi / 2 * int(4 * hashed(i, j, 9)))} }}",
                               f"Translation {{ translation {vector((x, t['top'] - 0.004, z))} }}", shape))
    write_part("table", f"""Tiled coffee table, {t['long']} m long (z), {t['wide']} m wide (x), tiles at {t['top']} m: things stand at that height.
Walnut rails, apron and tapered legs; 8 x 4 glazed tiles of 147 mm at a pitch of {t['pitch']} m in grout.""",
               group("WOOD", *wood, *parts, *legs),
               group("GROUT", material((0.62, 0.60, 0.56)), block(-0.302, 0.302, t["top"] - 0.012, t["top"] - 0.0022, -0.602, 0.602)),
               group("TILES", *tiles))


# ---- the telephone ----

def telephone_body():
    rows = []

    def row(y, width, z_back, z_front, radius):
        mid = (z_back + z_front) / 2
        rows.append([(x, y, z + mid) for x, z in rounded_rectangle(width, z_front - z_back, radius, 6)])
    for y, grow in ((0.004, -0.004), (0.0055, -0.0012), (0.008, 0), (0.018, 0), (0.0205, -0.0012), (0.022, -0.004)):
        row(y, 0.204 + 2 * grow, -0.082 - grow, 0.084 + grow, 0.022 + grow)
    for k in range(17):
        t = k / 16
        y = 0.0225 + 0.0855 * t
        width = 0.112 + 0.074 * (1 - t) ** 1.9
        row(y, width, -0.074 + 0.016 * t + 0.006 * t * (1 - t), 0.0745 - 0.049 * t, 0.018)
    for y, inset in ((0.1100, 0.0008), (0.1116, 0.0026), (0.1126, 0.0054), (0.1130, 0.0090)):
        row(y, 0.112 - 2 * inset, -0.058 + inset, 0.0255 - inset, 0.018 - 0.5 * inset)
    return loft(rows)


def finger_wheel(radius, thickness, hole=0.0062, at_radius=0.0272, facets=16):
    """A disc in the plane y = 0 to `thickness` with ten round holes, thirty degrees apart."""
    mesh = Mesh()
    inner = 0.0185
    for sector in range(12):
        a0 = 2 * pi * sector / 12

        def polar(r, a):
            return (r * sin(a0 + a), r * cos(a0 + a))
        if sector < 10:
            rim, edge = [], []
            cx, cz = polar(at_radius, 0)
            half = pi / 12
            for k in range(facets):
                a = 2 * pi * k / facets
                dr, dt = cos(a), sin(a)
                m = max(abs(dr), abs(dt))
                r = (inner + radius) / 2 + (radius - inner) / 2 * dr / m
                edge.append(polar(r, half * dt / m))
                px, pz = polar(at_radius + hole * dr, 0)
                rim.append((px + hole * dt * cos(a0), pz - hole * dt * sin(a0)))
            points = [(x, thickness, z) for x, z in edge] + [(x, thickness, z) for x, z in rim] \
                + [(x, 0.0, z) for x, z in rim]
            mesh.join(Mesh(points, grid_faces(3, facets, wrap=True)))
        else:
            corners = [polar(inner + (radius - inner) * i, pi / 12 * (k / 2 - 1)) for i in (0, 1) for k in range(5)]
            mesh.join(Mesh([(x, thickness, z) for x, z in corners], grid_faces(2, 5)))
    hub = []
    for k in range(48):
        a = 2 * pi * (k - 0.5) / 48
        hub.append((inner * sin(a), thickness, inner * cos(a)))
    mesh.join(Mesh(hub, [tuple(range(48))]))
    side = [(radius, thickness), (radius + 0.0006, thickness - 0.0006), (radius + 0.0006, 0.0)]
    mesh.join(lathe(side[::-1], 48))
    for n, f in enumerate(mesh.faces):
        a, b, c = (mesh.points[i] for i in f[:3])
        if abs(a[1] - b[1]) < 1e-9 and abs(b[1] - c[1]) < 1e-9 and cross(sub(b, a), sub(c, a))[1] < 0:
            mesh.faces[n] = f[::-1]
    return mesh


def dial():
    """The dial in its own plane: y is out of the face, -z is the top of the face. Radius 44 mm."""
    disc = Mesh([(0.0395 * sin(2 * pi * k / 48), 0.0046, 0.0395 * cos(2 * pi * k / 48)) for k in range(48)], [tuple(range(48))])
    disc.uv = [(0.5 + p[0] / 0.08, 0.5 - p[2] / 0.08) for p in disc.points]
    rim = lathe([(0.044, 0.0), (0.044, 0.0052), (0.0433, 0.0064), (0.0420, 0.0068), (0.0405, 0.0062), (0.0395, 0.0046)], 48)
    wheel = finger_wheel(0.0365, 0.0014).turned("y", FIRST_HOLE).moved(0, 0.0072, 0)
    hub = lathe([(0.0190, 0.0086), (0.0185, 0.0095), (0.0165, 0.0098), (0.0150, 0.0091)], 40)
    card = lathe([(0.0150, 0.0091), (0, 0.0092)], 32)
    card.uv = [(0.5 + p[0] / 0.031, 0.5 - p[2] / 0.031) for p in card.points]
    a = FIRST_HOLE - pi / 6 * 1.55
    stop = sweep(curve([(0.0415 * sin(a), 0.0066, 0.0415 * cos(a)), (0.036 * sin(a), 0.0102, 0.036 * cos(a)),
                        (0.029 * sin(a), 0.0100, 0.029 * cos(a)), (0.0235 * sin(a + 0.09), 0.0094, 0.0235 * cos(a + 0.09))], 4),
                 ring(0.0017, 8, 0.6))
    return [group("NUMBER_PLATE", material((0.92, 0.90, 0.84), 0.06, 0.6), texture("dial.png", "CLAMP"), surface(disc, 0, 5)),
            group("DIAL_RIM", BRASS, surface(rim, 0.7, 5)),
            group("FINGER_WHEEL", material((0.09, 0.085, 0.08), 0.25, 0.6), surface(wheel, 0.4, 5)),
            group("DIAL_HUB", BRASS, surface(hub, 0.7, 5)),
            group("NUMBER_CARD", material((0.92, 0.90, 0.86)), texture("dial-card.png", "CLAMP"), surface(card, 0.3, 5)),
            group("FINGER_STOP", BRASS, surface(stop, 0.8, 5))]


FIRST_HOLE = pi * 0.42  # where the hole for 1 sits, from the foot of the dial toward +x (the right)


def handset():
    arch = curve([(-0.101, 0.116, 0), (-0.0955, 0.133, 0), (-0.078, 0.1455, 0), (-0.045, 0.1502, 0), (0, 0.1520, 0),
                  (0.045, 0.1502, 0), (0.078, 0.1455, 0), (0.0955, 0.133, 0), (0.101, 0.116, 0)], 6)
    grip = sweep(arch, [(0.0135 * cos(2 * pi * k / 20), 0.0112 * sin(2 * pi * k / 20)) for k in range(20)],
                 lambda t: 1.0 + 0.10 * cos(pi * (2 * t - 1)) - 0.12 * abs(2 * t - 1) ** 3)
    cup = [(0, -0.0165), (0.019, -0.0165), (0.0215, -0.0190), (0.0285, -0.0205), (0.0315, -0.0195), (0.0325, -0.0170),
           (0.0325, -0.0120), (0.0312, -0.0098), (0.0285, -0.0080), (0.0270, -0.0040), (0.0225, 0.0030),
           (0.0165, 0.0085), (0.0130, 0.0150), (0.0110, 0.0200), (0, 0.0220)]
    parts = [surface(grip, 0.8, 5, "GRIP")]
    for name, s in (("EAR_PIECE", 1), ("MOUTH_PIECE", -1)):
        parts.append(at(s * 0.1015, 0.1135, 0, surface(lathe(cup, 36), 0.7, 5, "CUP") if s > 0 else "USE CUP",
                        name=name, turn=((0, 0, 1), -s * 0.22)))
    ribs = [lathe([(0.0329, -0.0150), (0.0337, -0.0142), (0.0337, -0.0134), (0.0329, -0.0126)], 40)
            .turned("z", -s * 0.22).moved(s * 0.1015, 0.1135, 0) for s in (-1, 1)]
    return group("HANDSET", BLACK, *parts, group("HANDSET_RINGS", BRASS, *[surface(m, 0.8, 5) for m in ribs]))


def cradle():
    neck = lathe([(0.031, 0.1115), (0.031, 0.1132)] + curve([(0.030, 0.1140), (0.022, 0.1158), (0.0160, 0.1192), (0.0150, 0.1225), (0.0162, 0.1255), (0.019, 0.1285)], 3)
                 + [(0, 0.1292)], 36)
    neck = neck.map(lambda p: (1.3 * p[0], p[1], p[2]))
    bar = rounded_box((0.118, 0.009, 0.015), 0.004, 3).moved(0, 0.1285, 0)
    parts = [surface(neck, 0.6, 5, "NECK"), surface(bar, 0.6, 5, "CROSS_BAR")]
    fork = curve([(0, 0.1640, -0.0245), (0, 0.1500, -0.0205), (0, 0.1395, -0.0165), (0, 0.1336, -0.0085), (0, 0.1325, 0),
                  (0, 0.1336, 0.0085), (0, 0.1395, 0.0165), (0, 0.1500, 0.0205), (0, 0.1640, 0.0245)], 4)
    prong = sweep(fork, ring(0.0042, 12), lambda t: 1.0 - 0.25 * abs(2 * t - 1) ** 2, up=(1, 0, 0))
    for n, s in enumerate((-1, 1)):
        shape = "USE FORK" if n else surface(prong, 0.9, 5, "FORK")
        tips = [at(0, 0.1650, z, "Sphere { radius 0.0048 }") for z in (-0.0248, 0.0248)]
        parts.append(at(s * 0.0530, 0, 0, shape, *tips))
    return group("CRADLE", BRASS, "Translation { translation 0 0 -0.017 }", *parts)


def cord(knots, name, radius=0.0029, steps=8, digits=5):
    """A cloth cord along a smooth curve through the knots."""
    path = curve(knots, steps)
    section = ring(radius, 8)
    return surface(sweep(path, section), 1.2, digits, name, material((0.20, 0.13, 0.08), 0.02, 0.1))


def telephone():
    lift = "Translation { translation 0 0 -0.017 }"
    tilt = 0.5285  # the front slopes back by atan(0.049 / 0.0855)
    face = at(0, 0.0660, 0.0500, *dial(), name="DIAL", turn=((1, 0, 0), pi / 2 - tilt))
    feet = [at(sx * 0.078, 0.002, sz * 0.062, cylinder(0.011, 0.004)) for sx in (-1, 1) for sz in (-1, 1)]
    knots = [(-0.112, 0.1125, -0.017), (-0.124, 0.109, -0.0165), (-0.136, 0.094, -0.014), (-0.150, 0.060, -0.004), (-0.157, 0.022, 0.016),
             (-0.163, 0.0052, 0.040), (-0.178, 0.0034, 0.068), (-0.205, 0.0034, 0.074), (-0.222, 0.0034, 0.050),
             (-0.212, 0.0034, 0.012), (-0.182, 0.0034, -0.040), (-0.150, 0.0034, -0.092), (-0.100, 0.0034, -0.122),
             (-0.050, 0.0040, -0.112), (-0.036, 0.0080, -0.092), (-0.034, 0.0110, -0.076)]
    write_part("telephone", """Antique desk telephone, 0.26 m across the handset, 0.20 x 0.17 m at the base, 0.17 m high.
It faces +z; the origin is on the table under its middle. Black body, brass cradle, dial with ten holes, cloth cord.""",
               group("BODY", BLACK, surface(telephone_body(), 0.55, 5)),
               group("FEET", material((0.10, 0.09, 0.08)), *feet), face, cradle(),
               group(None, lift, handset()), cord(knots, "CORD"))


def telephone_line():
    """From the telephone's back over the left edge of the table, across the floor to a socket under the window."""
    top = TABLE["top"] + 0.003
    knots = [(-0.108, 0.4320, 0.352), (-0.110, 0.4300, 0.330), (-0.125, 0.4250, 0.290), (-0.165, top, 0.245), (-0.230, top, 0.225), (-0.300, top, 0.235),
             (-0.345, top, 0.248), (-0.366, top, 0.252), (-0.3755, 0.4150, 0.254), (-0.3770, 0.3900, 0.255), (-0.381, 0.30, 0.258), (-0.392, 0.16, 0.262),
             (-0.408, 0.05, 0.268), (-0.440, 0.0150, 0.276), (-0.500, 0.0135, 0.290), (-0.700, 0.0135, 0.345), (-0.900, 0.0135, 0.360), (-0.965, 0.0110, 0.352),
             (-1.010, 0.0035, 0.345), (-1.300, 0.0035, 0.300), (-1.70, 0.0035, 0.16), (-2.10, 0.0035, 0.10), (-2.50, 0.0035, 0.160), (-2.62, 0.0040, 0.200),
             (-2.655, 0.020, 0.212), (-2.668, 0.045, 0.215), (-2.674, 0.058, 0.215)]
    socket = rounded_box((0.014, 0.062, 0.062), 0.004, 2).moved(-2.678, 0.066, 0.215)
    write_part("telephone-line", """The telephone's line, in the room's own coordinates: over the edge of the coffee table, under it across rug and
floor, to a socket on the skirting below the windows.""",
               cord(knots, "LINE", 0.0024, 5, 4), group("SOCKET", material((0.42, 0.30, 0.20), 0.05, 0.4), surface(socket, 0.6)))


# ---- the book ----

BOOK = dict(tall=0.262, deep=0.190, thick=0.056)


def book():
    b = BOOK
    board = 0.0034
    top = rounded_box((b["tall"], board, b["deep"]), 0.0012, 2)
    top.uv = [(p[0] / b["tall"] + 0.5, 0.5 - p[2] / b["deep"]) for p in top.points]
    hinge, out = b["deep"] / 2 - 0.004, 0.0085
    arc = []
    for k in range(13):
        t = k / 12
        arc.append((t * b["thick"], hinge + out * sin(pi * t) ** 0.75 + 0.003))
    n = len(arc)
    spine = Mesh([(x, y, z) for x in (-b["tall"] / 2, b["tall"] / 2) for y, z in arc], [], [])
    spine.faces = [(k, n + k, n + k + 1, k + 1) for k in range(n - 1)]
    spine.uv = [(u, k / (n - 1)) for u in (0, 1) for k in range(n)]
    inside = [(x, y * 0.96 + 0.02 * b["thick"], z - 0.0022) for x, y, z in spine.points]
    ends = Mesh(spine.points + inside, [])
    for base, flip in ((0, False), (n, True)):
        for k in range(n - 1):
            f = (base + k, base + k + 1, 2 * n + base + k + 1, 2 * n + base + k)
            ends.faces.append(f[::-1] if flip else f)
    pt = b["thick"] - 2 * board
    rows = []
    for x in (-b["tall"] / 2 + 0.004, b["tall"] / 2 - 0.004):
        outline = [(x, board + pt * k / 12, hinge + (out - 0.003) * sin(pi * k / 12) ** 0.75) for k in range(13)]
        fore = [(x, board + pt * k / 12, -b["deep"] / 2 + 0.004 + 0.006 * sin(pi * k / 12)) for k in range(13)]
        rows.append(outline + fore[::-1])
    pages = loft(rows, caps=False)
    for row in (0, 26):
        pages.faces += [(row + k, row + k + 1, row + 24 - k, row + 25 - k)[::1 if row else -1] for k in range(12)]
    pages = pages.outward()
    pages.uv = [(p[0] / 0.2 + p[2] / 0.2, p[1] / 0.052) for p in pages.points]
    cloth = material((0.95, 0.95, 0.95), 0.04, 0.25)
    write_part("book", f"""A thick textbook lying on its back cover, spine toward +z: {b['tall']} m along x, {b['deep']} m along z,
{b['thick']} m thick. The lettering of cover and spine is in the textures book-cover.png and book-spine.png.""",
               group("FRONT_COVER", cloth, texture("book-cover.png", "CLAMP"), surface(top.moved(0, b["thick"] - board / 2, 0), 0.5)),
               group("BACK_COVER", material((0.40, 0.06, 0.06), 0.04, 0.25), at(0, board / 2, 0, surface(Mesh(top.points, top.faces), 0.5))),
               group("SPINE", cloth, texture("book-spine.png", "CLAMP"), surface(spine, 1.0, 5)),
               group("SPINE_EDGE", material((0.40, 0.06, 0.06)), surface(ends, 0.3, 5)),
               group("PAGES", material((0.93, 0.90, 0.82)), texture("pages.png"), surface(pages, 0.6, 5)))


# ---- the lamp ----

def lamp():
    base = lathe([(0.150, 0), (0.150, 0.012), (0.146, 0.018), (0.120, 0.024), (0.060, 0.032), (0.030, 0.045), (0.018, 0.070), (0.0135, 0.10)], 36)
    knob = lathe([(0.0095, 0.70), (0.016, 0.71), (0.022, 0.73), (0.016, 0.75), (0.0095, 0.76)], 20)
    collar = lathe([(0.0095, 1.18), (0.020, 1.19), (0.024, 1.205), (0.018, 1.22), (0.016, 1.25), (0, 1.255)], 20)
    shade = lathe([(0.232, 1.240), (0.235, 1.240), (0.236, 1.246), (0.117, 1.554), (0.115, 1.560), (0.112, 1.560), (0.232, 1.240)], 48)
    spider = []
    for k in range(3):
        a = 2 * pi * k / 3 + 0.4
        spider.append(at(0.123 * sin(a), 1.246, 0.123 * cos(a), "Rotation { rotation 1 0 0 1.5708 }", cylinder(0.0010, 0.222), turn=((0, 1, 0), a)))
    write_part("lamp", """Floor lamp, 1.56 m high: brass foot (radius 0.15 m) and stem, linen shade open at top and bottom
(radius 0.235 m below, 0.115 m above, from 1.24 to 1.56 m) on a spider of three wires. Its light is
livroom.iv's: two spots just outside the openings, so that the shade throws no hard edge.""",
               group("FOOT", BRASS, surface(base, 0.5), surface(knob, 0.8), surface(collar, 0.8), at(0, 0.64, 0, cylinder(0.0095, 1.13)), *spider),
               group("SHADE", material((0.62, 0.50, 0.34), emissive=(0.52, 0.39, 0.22)), surface(shade, 0.4)))


# ---- sofa and armchair ----

def clothed(mesh, per_meter):
    """Gives every point a texture coordinate by a slanted projection, which stretches no side of a box."""
    mesh.uv = [(per_meter * (x + 0.62 * z), per_meter * (y + 0.71 * z)) for x, y, z in mesh.points]
    return mesh


def turned_leg(height, radius):
    r = radius
    return surface(lathe([(0, 0), (0.55 * r, 0), (0.6 * r, 0.004), (0.72 * r, 0.35 * height), (r, height)], 16), 0.6)


def pillow(size, thick):
    """A throw pillow in the plane z = 0: thin at the seams, pinched between its corners."""
    def side(s):
        def place(u, v):
            a, b = 2 * u - 1, 2 * v - 1
            swell = (1 - a ** 4) * (1 - b ** 4)
            pinch = 1 - 0.06 * (1 - b * b) if abs(a) > abs(b) else 1 - 0.06 * (1 - a * a)
            return (s * a * size / 2 * pinch, b * size / 2 * pinch, s * thick / 2 * sqrt(max(0.0, swell)) * (1 - 0.12 * hypot(a, b)))
        return sheet(13, 13, place)
    both = side(1).join(side(-1)).welded(1e-5)
    both.uv = [(0.5 + p[0] / size, 0.5 + p[1] / size) for p in both.points]
    return both.outward()


def seat(name, about, seats, cushion, arm, fabric, per_meter, extras=()):
    """A sofa or an armchair facing +z, its arms and cushions of the given widths."""
    wide = seats * cushion + 2 * arm[0]
    inner = seats * cushion

    def soft(size, radius, place, tilt=0.0, bulge=(0, 0, 0), middle=4, name=None):
        m = rounded_box(size, radius, 1 if middle == 1 else 3, middle, bulge).turned("x", tilt).moved(*place)
        return surface(clothed(m, per_meter), 1.0, 4, name)
    parts = [soft((inner + 0.10, 0.21, 0.80), 0.02, (0, 0.235, 0.0), name="BASE", middle=1),
             soft((inner + 0.16, 0.52, 0.18), 0.06, (0, 0.58, -0.33), -0.14, (0, 0.01, 0.01), 2, name="BACK")]
    outer = rounded_box((arm[0], arm[1] + 0.08, 0.88), 0.075, 3, 2, (0.008, 0.0, 0.008)).moved(0, -0.04, 0)
    flare = outer.map(lambda p: (p[0] + 0.10 * max(0.0, p[1] / arm[1] + 0.1) ** 2 * arm[0], max(p[1], -arm[1] / 2), p[2]))
    out, up = inner / 2 + arm[0] / 2 - 0.004, 0.13 + arm[1] / 2
    parts.append(at(out, up, 0.005, surface(clothed(flare, per_meter), 1.0, 4, "ARM"), name="ARM_RIGHT"))
    parts.append(at(-out, up, 0.005, "USE ARM", name="ARM_LEFT", turn=((0, 1, 0), pi)))
    bottom = soft((cushion - 0.008, 0.15, 0.64), 0.045, (0, 0, 0), 0, (0.004, 0.022, 0.006), 4, "SEAT_CUSHION")
    back = soft((cushion - 0.012, 0.42, 0.17), 0.06, (0, 0, 0), -0.22, (0.004, 0.012, 0.045), 4, "BACK_CUSHION")
    for k in range(seats):
        x = (k - (seats - 1) / 2) * cushion
        parts.append(at(x, 0.405, 0.115, bottom if k == 0 else "USE SEAT_CUSHION"))
        parts.append(at(x, 0.665, -0.185, back if k == 0 else "USE BACK_CUSHION"))
    leg = turned_leg(0.135, 0.026)
    legs = [at(sx * (wide / 2 - 0.09), 0, sz * 0.33, leg) for sx in (-1, 1) for sz in (-1, 1)]
    write_part(name, about.format(wide=number(wide)), group("UPHOLSTERY", *fabric, *parts),
               group("LEGS", material((0.22, 0.13, 0.08), 0.06, 0.5), *legs), *extras)


def sofa():
    cover = group("PILLOW", surface(pillow(0.42, 0.17), 1.2))
    extras = [at(-0.56, 0.665, -0.02, material((0.80, 0.55, 0.25), 0.02, 0.1), texture("fabric.png"), cover, turn=((0.92, 0.30, 0.26), -0.45)),
              at(0.60, 0.665, -0.015, material((0.82, 0.78, 0.68), 0.02, 0.1), texture("fabric.png"), "USE PILLOW", turn=((0.90, -0.38, -0.2), -0.42))]
    seat("sofa", """Sofa for two and a half, {wide} m wide, 0.9 m deep, seat at 0.5 m, facing +z.
Origin on the floor under its middle. Base, back, two arms, two seat and two back cushions, two throw pillows.""",
         2, 0.80, (0.20, 0.50), [material((0.36, 0.50, 0.44), 0.02, 0.1), texture("fabric.png")], 4.0, extras)


def armchair():
    seat("armchair", """Armchair in leather, {wide} m wide, 0.9 m deep, seat at 0.5 m, facing +z.
Origin on the floor under its middle.""",
         1, 0.54, (0.19, 0.47), [material((0.62, 0.36, 0.20), 0.035, 0.25), texture("leather.png")], 3.0)


# ---- bookshelf and sideboard ----

SPINES = [(0.42, 0.10, 0.08), (0.12, 0.22, 0.33), (0.16, 0.30, 0.20), (0.55, 0.40, 0.18), (0.70, 0.64, 0.50), (0.25, 0.14, 0.10),
          (0.10, 0.11, 0.14), (0.50, 0.22, 0.12), (0.30, 0.32, 0.36), (0.62, 0.52, 0.36), (0.29, 0.11, 0.10), (0.17, 0.25, 0.24)]


def row_of_books(x0, x1, y, z_front, seed, tallest):
    """Books side by side from x0 to x1 on a shelf at y, spines toward +z; some have gilt bands."""
    out, x, n = [], x0, 0
    while True:
        thick = 0.018 + 0.034 * hashed(n, 1, seed) ** 1.5
        if x + thick > x1:
            return out, x
        tall = tallest * (0.70 + 0.29 * hashed(n // 3, 2, seed) - 0.05 * hashed(n, 3, seed))
        deep = 0.13 + 0.06 * hashed(n, 4, seed)
        back = 0.012 * hashed(n, 6, seed)
        color = SPINES[int(12 * hashed(n // 2, 5, seed + n % 2 * int(2 * hashed(n, 9, seed))))]
        shade = 0.8 + 0.35 * hashed(n, 7, seed)
        out.append(at(x + thick / 2, y + tall / 2, z_front - back - deep / 2, material(times(color, shade), 0.02, 0.2),
                      cube(thick - 0.0012, tall, deep)))
        if hashed(n, 8, seed) > 0.45:
            for k in (0.14, 0.80):
                out.append(at(x + thick / 2, y + k * tall, z_front - back - 0.002, "USE GILT", cube(thick - 0.0008, 0.006, 0.0052)))
        x, n = x + thick, n + 1


def bookshelf():
    wide, high, deep, board = 1.10, 2.05, 0.30, 0.024
    wood = [material((0.48, 0.25, 0.125), 0.05, 0.4), texture("walnut.png")]

    def plank(size, place, grain):
        m = rounded_box(size, 0.003, 1)
        k = {"x": 0, "y": 1}[grain]
        m.uv = [(p[k] / 0.6 + place[1] * 1.3, (p[1 - k] + p[2]) / 0.2 + place[1] * 2.1 + place[0]) for p in m.points]
        return surface(m.moved(*place), 0.5)
    levels = [0.09, 0.47, 0.82, 1.15, 1.46, 1.75]
    parts = [plank((board, high, deep), (s * (wide - board) / 2, high / 2, 0), "y") for s in (-1, 1)]
    parts += [plank((wide - 2 * board, board, deep - 0.012), (0, y - board / 2, -0.004), "x") for y in levels]
    parts.append(plank((wide + 0.05, 0.03, deep + 0.03), (0, high + 0.015, 0.004), "x"))
    parts.append(plank((wide - 2 * board, 0.066, 0.018), (0, 0.033, deep / 2 - 0.03), "x"))
    parts.append(plank((wide - 2 * board, high - 0.06, 0.008), (0, high / 2 + 0.03, -deep / 2 + 0.006), "x"))
    books = [group(None, "DEF GILT " + BRASS)]
    lo, hi = -wide / 2 + board + 0.004, wide / 2 - board - 0.004
    front = deep / 2 - 0.035
    spans = [(0, lo, hi, 0.33), (1, lo, lo + 0.62, 0.31), (2, lo + 0.30, hi, 0.29), (3, lo, hi - 0.12, 0.27), (4, lo, lo + 0.40, 0.25), (4, lo + 0.74, hi, 0.25), (5, lo + 0.12, lo + 0.60, 0.24)]
    for n, (level, a, b, tall) in enumerate(spans):
        made, end = row_of_books(a, b, levels[level], front, 21 + 7 * n, tall)
        books += made
        if n in (1, 3) and b + 0.10 < hi + 0.13:
            h = tall * 0.82
            lean = 0.16
            books.append(at(end + 0.014 + h / 2 * sin(lean), levels[level] + h / 2 * cos(lean) + 0.0022, front - 0.085,
                            material(SPINES[n], 0.02, 0.2), cube(0.026, h, 0.16), turn=((0, 0, 1), lean)))
    for k, (w, t, d, c) in enumerate(((0.22, 0.034, 0.16, 3), (0.20, 0.028, 0.15, 8), (0.185, 0.022, 0.14, 10))):
        y = levels[1] + (0, 0.034, 0.062)[k] + t / 2
        books.append(at(hi - 0.15 + 0.006 * k, y, front - 0.09, material(SPINES[c], 0.02, 0.2), cube(w, t, d), turn=((0, 1, 0), 0.10 * (1 - k))))
    globe = group("GLOBE", at(lo + 0.14, levels[2] + 0.172, 0, material((0.30, 0.44, 0.50), 0.12, 0.6), texture("globe.png"), "Sphere { radius 0.088 }",
                              turn=((0, 0, 1), 0.41)),
                  at(lo + 0.14, levels[2], 0, BRASS, surface(lathe([(0.062, 0), (0.062, 0.006), (0.050, 0.012), (0.016, 0.020), (0.008, 0.036), (0.006, 0.080), (0, 0.085)], 24), 0.6)),
                  at(lo + 0.14, levels[2] + 0.172, 0, BRASS, surface(sweep([(0.094 * sin(a), 0.094 * cos(a), 0) for a in (pi * k / 18 - 0.41 for k in range(19))], ring(0.0028, 6)), 1.2)))
    vase = at(lo + 0.57, levels[4], -0.01, material((0.72, 0.66, 0.52), 0.10, 0.6), surface(lathe(
        [(0, 0)] + curve([(0.030, 0), (0.034, 0.004), (0.058, 0.055), (0.062, 0.085), (0.048, 0.130), (0.024, 0.160), (0.020, 0.180), (0.030, 0.200)], 2)
        + [(0.027, 0.200), (0.017, 0.180), (0, 0.15)], 24), 0.8), name="JUG")
    cones = group("WOODEN_SOLIDS", material((0.74, 0.55, 0.34), 0.03, 0.3),
                  at(hi - 0.14, levels[5] + 0.075, 0, "Cone { bottomRadius 0.05 height 0.15 }"),
                  at(hi - 0.27, levels[5] + 0.045, 0.03, "Sphere { radius 0.045 }"),
                  at(hi - 0.35, levels[5] + 0.04, -0.04, cube(0.07, 0.08, 0.07), turn=((0, 1, 0), 0.5)))
    write_part("bookshelf", f"""Bookshelf, {wide} m wide, {high + 0.03} m high, {deep} m deep, facing +z; its back is at z = -{deep / 2}.
Six shelves of books (cubes, the exact primitive), a globe, a jug, and a cone, a sphere and a cube of wood.""",
               group("CASE", *wood, *parts), group("BOOKS", *books), globe, vase, cones)


def sideboard():
    wide, high, deep = 1.30, 0.74, 0.40
    wood = [material((0.58, 0.32, 0.165), 0.07, 0.5), texture("walnut.png")]

    def plank(size, place, grain="x", r=0.003):
        m = rounded_box(size, r, 1)
        k = {"x": 0, "y": 1}[grain]
        m.uv = [(p[k] / 0.6 + place[0], (p[1 - k] + p[2]) / 0.2 + place[1] * 3 + place[0]) for p in m.points]
        return surface(m.moved(*place), 0.5)
    parts = [plank((wide, 0.026, deep), (0, high - 0.013, 0), r=0.006),
             plank((wide - 0.04, high - 0.18, deep - 0.03), (0, (high - 0.026 + 0.154) / 2, -0.012))]
    fronts = [(-0.4167, 0.405), (0, 0.405), (0.4167, 0.405)]
    for x, w in fronts:
        parts.append(plank((w, 0.150, 0.016), (x, high - 0.115, deep / 2 - 0.022), r=0.004))
        parts.append(plank((w, 0.360, 0.016), (x, high - 0.380, deep / 2 - 0.022), "y", r=0.004))
    knobs = [at(x + dx, y, deep / 2 - 0.006, "Sphere { radius 0.011 }") for x, _ in fronts for dx, y in ((0, high - 0.115), (0.15 if x < 0.1 else -0.15, high - 0.36))]
    leg = turned_leg(0.165, 0.024)
    legs = [at(sx * (wide / 2 - 0.08), 0, sz * (deep / 2 - 0.07), leg) for sx in (-1, 1) for sz in (-1, 1)]
    bowl = surface(lathe([(0, 0.004), (0.045, 0.004), (0.047, 0), (0.052, 0), (0.055, 0.006), (0.100, 0.032), (0.128, 0.062), (0.125, 0.064),
                          (0.096, 0.037), (0.050, 0.012), (0, 0.010)], 40), 0.7)
    fruit = [at(0.042 * sin(a), 0.048, 0.042 * cos(a), material(c, 0.05, 0.4), "Sphere { radius 0.036 }")
             for a, c in ((0.3, (0.78, 0.36, 0.08)), (2.4, (0.80, 0.42, 0.10)), (4.5, (0.66, 0.10, 0.07)))]
    fruit.append(at(0.002, 0.098, 0.0, material((0.76, 0.34, 0.08), 0.05, 0.4), "Sphere { radius 0.035 }"))
    write_part("sideboard", f"""Sideboard, {wide} m wide, {high} m high, {deep} m deep, facing +z, with drawers, doors and brass knobs.
On it a bowl of fruit and a vase with twigs.""",
               group("CASE", *wood, *parts), group("KNOBS", BRASS, *knobs),
               group("LEGS", material((0.25, 0.15, 0.09), 0.06, 0.5), *legs),
               at(0.36, high, 0.02, group("BOWL", material((0.84, 0.82, 0.76), 0.10, 0.7), bowl), group("FRUIT", *fruit)),
               at(-0.40, high, 0.0, *vase_with_twigs()))


def vase_with_twigs():
    vase = surface(lathe([(0, 0)] + curve([(0.050, 0), (0.056, 0.005), (0.078, 0.060), (0.088, 0.115), (0.078, 0.170), (0.046, 0.225), (0.034, 0.255),
                                                (0.036, 0.280), (0.047, 0.300)], 2) + [(0.043, 0.300), (0.030, 0.270), (0.028, 0.24), (0, 0.22)], 36), 0.8)
    twigs, leaves = Mesh(), Mesh()
    for k in range(9):
        a, out, tall = 2 * pi * k / 9 + 0.5 * hashed(k, 1, 3), 0.07 + 0.13 * hashed(k, 2, 3), 0.50 + 0.26 * hashed(k, 3, 3)
        d = (sin(a), cos(a))
        path = curve([(0.012 * d[0], 0.235, 0.012 * d[1]), (0.028 * d[0], 0.31, 0.028 * d[1]),
                      (0.55 * out * d[0], 0.30 + 0.55 * (tall - 0.3), 0.55 * out * d[1]), (out * d[0], tall, out * d[1])], 4)
        twigs.join(sweep(path, ring(0.0022, 5), lambda t: 1 - 0.6 * t))
        for j in range(9):
            at_path = path[3 + j] if 3 + j < len(path) else path[-1]
            b = a + 2.4 * j + hashed(j, k, 4)
            size = 0.044 + 0.022 * hashed(j, k, 5) - 0.002 * j
            side = (cos(b), 0.35 + 0.4 * hashed(j, k, 6), sin(b))
            up = unit(side)
            across = unit(cross(up, (0.2, 1, 0.1)))
            bend = unit(cross(across, up))
            n = len(leaves.points)
            shape = [(0, 0, 0), (0.30, 0.28, 0.03), (0.65, 0.26, 0.04), (1.0, 0, -0.06), (0.65, -0.26, 0.04), (0.30, -0.28, 0.03)]
            leaves.points += [add(at_path, add(times(up, 1.5 * size * s), add(times(across, size * t), times(bend, size * 3 * h)))) for s, t, h in shape]
            leaves.points.append(add(at_path, times(up, 0.75 * size)))
            leaves.faces += [(n + i, n + (i + 1) % 6, n + 6) for i in range(6)]
    return [group("VASE", material((0.16, 0.26, 0.44), 0.14, 0.8), vase), group("TWIGS", material((0.28, 0.19, 0.11)), surface(twigs, 1.2)),
            group("LEAVES", material((0.42, 0.50, 0.26), 0.03, 0.2), surface(leaves, 0.9))]


# ---- rug, picture, curtain, and what is outside ----

RUG = dict(wide=1.90, long=2.50)


def rug():
    w, l = RUG["wide"], RUG["long"]

    def place(u, v):
        lift = 0.0012 * sin(7 * u + 3 * v) + 0.0010 * sin(11 * v - 5 * u)
        return (w * (u - 0.5), 0.0085 + lift, l * (0.5 - v))
    top = sheet(21, 17, place)
    rim = block(-w / 2, w / 2, 0.0005, 0.0062, -l / 2, l / 2)
    points, counts = [], []
    for end in (-1, 1):
        for k in range(150):
            x = w * ((k + 0.5) / 150 - 0.5)
            reach = 0.050 + 0.012 * hashed(k, end, 2)
            slant = 0.016 * (hashed(k, end, 3) - 0.5)
            quad = [(x - 0.0030, 0.0062, end * l / 2), (x + 0.0030, 0.0062, end * l / 2),
                    (x - 0.0024 + slant, 0.0020, end * (l / 2 + reach)), (x + 0.0024 + slant, 0.0020, end * (l / 2 + reach))]
            if end > 0:
                quad = [quad[1], quad[0], quad[3], quad[2]]
            points += quad
            counts.append("4")
    fringe = group("FRINGE", material((0.80, 0.74, 0.60)), hints(0), "Coordinate3 { point [\n" + indent(wrap(vector(p) for p in points)) + " ] }",
                   "TriangleStripSet { numVertices [\n" + indent(wrap(counts)) + " ] }")
    write_part("rug", f"""Rug, {w} m wide (x) and {l} m long (z), 9 mm thick, with a fringe of 300 threads at both ends.
Origin on the floor under its middle.""",
               group("PILE", material((0.95, 0.93, 0.90)), texture("rug.png", "CLAMP"), hints(1.5), quad_mesh(21, 17, top)),
               group("EDGE", material((0.30, 0.08, 0.08)), rim), fringe)


def picture():
    w, h = 0.98, 0.74
    profile = [(0, 0), (0, 0.020), (0.006, 0.030), (0.016, 0.033), (0.024, 0.028), (0.034, 0.020), (0.046, 0.022), (0.054, 0.018), (0.060, 0.010), (0.060, 0.002)]
    sections = []
    for sx, sy in ((-1, -1), (1, -1), (1, 1), (-1, 1)):
        sections.append([(sx * (w / 2 - d), sy * (h / 2 - d), z) for d, z in profile])
    n = len(profile)
    frame = Mesh([p for s in sections for p in s], [])
    for k in range(4):
        for j in range(n - 1):
            a, b = k * n + j, ((k + 1) % 4) * n + j
            frame.faces.append((a, b, b + 1, a + 1))
    mat = group("MAT", material((0.90, 0.88, 0.82)), block(-w / 2 + 0.055, w / 2 - 0.055, -h / 2 + 0.055, h / 2 - 0.055, 0.001, 0.004))
    pw, ph = w / 2 - 0.125, h / 2 - 0.125
    canvas = sheet(2, 2, lambda u, v: (pw * (2 * u - 1), ph * (2 * v - 1), 0.009))
    write_part("picture", f"""Framed landscape, {w} x {h} m, hanging in the plane z = 0 and facing +z; origin in its middle.
Gilt moulding, mat, and the painting as a texture.""",
               group("MOULDING", material((0.46, 0.33, 0.15), (0.22, 0.18, 0.10), 0.35), surface(frame, 0.5)), mat,
               group("PAINTING", material((0.95, 0.95, 0.95)), texture("painting.png", "CLAMP"), surface(canvas, 0)))


def prints():
    """Two small framed engravings side by side; the same frame with two textures."""
    w, h, bar = 0.40, 0.52, 0.022
    paper = sheet(2, 2, lambda u, v: ((w / 2 - bar) * (2 * u - 1), (h / 2 - bar) * (2 * v - 1), 0.006))
    frame = [block(s * (w - bar) / 2 - bar / 2, s * (w - bar) / 2 + bar / 2, -h / 2, h / 2, 0.001, 0.020) for s in (-1, 1)]
    frame += [block(-w / 2 + bar, w / 2 - bar, s * (h - bar) / 2 - bar / 2, s * (h - bar) / 2 + bar / 2, 0.001, 0.019) for s in (-1, 1)]
    white = material((0.95, 0.95, 0.95))
    write_part("prints", f"""Two engravings in black frames, {w} x {h} m each, hanging in the plane z = 0 and facing +z, 0.56 m apart.""",
               at(-0.28, 0, 0, group("FRAME", material((0.10, 0.08, 0.07), 0.05, 0.4), *frame),
                  group(None, white, texture("print-lens.png", "CLAMP"), "DEF PAPER " + surface(paper, 0))),
               at(0.28, 0, 0, "USE FRAME", group(None, white, texture("print-eye.png", "CLAMP"), "USE PAPER")))


def plant():
    """A rubber plant in a pot: one leaf, used again along every stem."""
    rows = [(0.0, 0.002), (0.12, 0.020), (0.3, 0.036), (0.5, 0.041), (0.7, 0.036), (0.88, 0.021), (1.0, 0.002)]
    leaf = Mesh()
    for t, half in rows:
        droop = -0.05 * t * t
        leaf.points += [(-half, droop + 0.010 * half / 0.041, 0.20 * t), (0, droop, 0.20 * t), (half, droop + 0.010 * half / 0.041, 0.20 * t)]
    leaf.faces = [f[::-1] for f in grid_faces(len(rows), 3)]
    stems, leaves = Mesh(), []
    for k, (lean, tall, turn) in enumerate(((0.10, 1.18, 0.4), (0.20, 0.92, 2.3), (0.17, 1.02, 4.4), (0.05, 1.34, 5.3))):
        path = curve([(0.02 * sin(turn), 0.27, 0.02 * cos(turn)), (0.5 * lean * sin(turn), 0.27 + 0.5 * tall - 0.1, 0.5 * lean * cos(turn)),
                      (lean * sin(turn), 0.25 + tall * 0.93, lean * cos(turn))], 6)
        stems.join(sweep(path, ring(0.008, 6), lambda t: 1 - 0.55 * t))
        count = 9
        for j in range(count):
            p = path[3 + j]
            around = turn + 2.4 * j + 0.5 * hashed(j, k, 91)
            rise = 0.10 + 0.55 * hashed(j, k, 92) - (0 if j < count - 1 else -0.5)
            size = 1.05 + 0.40 * hashed(j, k, 93) - 0.03 * j
            place = f"Transform {{ translation {vector(p)} rotation 0 1 0 {number(around % (2 * pi), 3)} scaleFactor {vector((size,) * 3, 2)} }}"
            tip = f"Rotation {{ rotation 1 0 0 {number(-rise, 3)} }}"
            leaves.append(group(None, place, tip, "USE LEAF" if leaves else surface(leaf, 1.0, 4, "LEAF")))
    pot = lathe([(0, 0), (0.105, 0), (0.110, 0.006), (0.140, 0.235), (0.152, 0.238), (0.155, 0.245), (0.155, 0.285), (0.150, 0.290), (0.140, 0.288),
                 (0.138, 0.262), (0, 0.262)], 32)
    write_part("plant", """A rubber plant, 1.5 m high, in a pot of radius 0.155 m; origin on the floor under the pot.""",
               group("POT", material((0.66, 0.36, 0.24), 0.02, 0.2), surface(pot, 0.6)),
               at(0, 0.2635, 0, material((0.16, 0.11, 0.08)), cylinder(0.138, 0.004), name="SOIL"),
               group("STEMS", material((0.26, 0.22, 0.13)), surface(stems, 1.2)),
               group("LEAVES", material((0.13, 0.27, 0.12), 0.08, 0.5), *leaves))


def curtain():
    """A pair of curtains on a rod for one window; wall in the plane x = 0, like window.iv."""
    foot, top = -0.67, 1.708

    def place(u, v):
        gather = 1 - 0.22 * sin(pi * clamp(0.15 + 0.85 * (1 - v))) * 0.6
        fold = sin(2 * pi * 5.5 * u + 0.6 * sin(3 * v)) * (0.030 + 0.016 * (1 - v)) + 0.008 * sin(2 * pi * 2.3 * u + 4 * v)
        return (0.140 + fold, foot + (top - foot) * v, 0.19 - 0.42 * (u - 0.5) * gather)
    cloth = sheet(9, 67, place)
    cloth.uv = None
    left = surface(cloth, 3.1, 4, "DRAPE")
    hoop = lathe([(0.0185 + 0.0028 * cos(a), 0.0028 * sin(a)) for a in (2 * pi * k / 6 for k in range(7))], 16).turned("x", pi / 2)
    rings = [at(0.140, 1.727, s * (0.775 + 0.06 * k), "USE RING" if s > 0 or k else surface(hoop, 1.2, 4, "RING")) for s in (-1, 1) for k in range(7)]
    rod = at(0.140, 1.735, 0, "Rotation { rotation 1 0 0 1.5708 }", cylinder(0.011, 2.37))
    ends = [at(0.140, 1.735, s * 1.19, "Sphere { radius 0.022 }") for s in (-1, 1)]
    hooks = [at(0.070, 1.735, s * 0.72, "Rotation { rotation 0 0 1 1.5708 }", cylinder(0.007, 0.140)) for s in (-1, 1)]
    write_part("curtain", """A pair of curtains on a brass rod, for one window of window.iv and with the same origin.
The rod is 2.4 m long, 1.735 m above the foot of the window; the drapes hang to 40 mm above the floor.""",
               group("DRAPES", material((0.62, 0.40, 0.30), 0.0), at(0, 0, 0.76, left), at(0, 0, -1.14, "USE DRAPE")),
               group("ROD", BRASS, rod, *ends, *hooks, *rings))


def outside():
    low, high, z0, z1 = -20.0, 9.8, -42.0, 24.0
    wall = sheet(2, 2, lambda u, v: (0, low + (high - low) * v, z1 + (z0 - z1) * u))
    wall.uv = [(u, 1 - (high - p[1]) / 13.8) for (u, v), p in zip(wall.uv, wall.points)]  # below -4 m the lowest row goes on
    write_part("outside", f"""What is seen through the windows: sky and garden, painted on a screen that shines by itself.
It stands in the plane x = 0, from z = {z0} to {z1} m and from y = {low} to {high} m. Put 22 m from the windows
(x = -25) it stays below the sun's way to them, which rises 0.43 m a meter.""",
               group("SCREEN", "LightModel { model BASE_COLOR }", material((1, 1, 1), emissive=(1, 1, 1)), texture("garden.png", "CLAMP"), surface(wall, 0)))


# ---- textures ----

def make_textures():
    def wood(base, dark, planks, seed, stretch):
        def pixel(x, y):
            u, v = x / 256, y / 256
            plank = int(v * planks) if planks else 0
            shift = hashed(plank, 3, seed)
            n = noise(u * 4 + 17 * shift, v * 32, 0, 32, seed) * 0.5 + noise(u * 8 * stretch, v * 64, 8 * stretch, 64, seed + 1) * 0.3 \
                + noise(u * 16, v * 128, 16, 128, seed + 2) * 0.2
            bands = 0.5 + 0.5 * sin(22 * (v + 0.06 * noise(u * 4, v * 8, 4, 8, seed + 3)) + 9 * noise(u * 2, v * 4, 2, 4, seed + 4))
            c = mix(dark, base, clamp(0.25 + 0.55 * n + 0.3 * bands))
            if planks:
                c = tuple(k * (0.82 + 0.30 * shift) for k in c)
                joint = (u + shift) % 1.0
                edge = min((v * planks) % 1.0, 1 - (v * planks) % 1.0)
                if edge < 0.02 or joint < 0.004:
                    c = tuple(k * 0.45 for k in c)
            return c
        return pixel
    paint("walnut.png", 256, 256, wood((1.00, 1.00, 1.00), (0.44, 0.36, 0.30), 0, 3, 1), 8)
    paint("floor.png", 256, 256, wood((0.98, 0.98, 0.98), (0.65, 0.555, 0.46), 10, 11, 1), 8)

    def wallpaper(x, y):
        u, v = x / 128, y / 128
        stripe = smooth(-0.15, 0.15, sin(2 * pi * u * 4))
        k = 0.945 + 0.045 * stripe + 0.02 * (noise(x / 2, y / 2, 64, 64, 2) - 0.5)
        return (k, k, k * 0.985)
    paint("wallpaper.png", 128, 128, wallpaper, 4)

    def tile(ground, ink, kind):
        def pixel(x, y):
            u, v = (x + 0.5) / 128 - 0.5, (y + 0.5) / 128 - 0.5
            cloud = 0.5 * noise(x / 22, y / 22, 0, 0, kind) + 0.5 * noise(x / 7, y / 7, 0, 0, kind + 1)
            c = tuple(k * (0.93 + 0.09 * cloud) for k in ground)
            if kind == 2:
                a, r = atan2(v, u), hypot(u, v)
                star = 0.30 + 0.075 * cos(8 * a)
                petals = smooth(0.009, -0.009, abs(r - star) - 0.018)
                heart = smooth(0.009, -0.009, r - 0.085 - 0.02 * cos(8 * a + pi))
                q = hypot(0.5 - abs(u), 0.5 - abs(v))
                corner = max(smooth(0.009, -0.009, abs(q - 0.20) - 0.016), smooth(0.009, -0.009, q - 0.10))
                c = mix(c, tuple(k * (0.8 + 0.3 * cloud) for k in ink), max(petals, heart, corner))
            return c
        return pixel
    pattern = tile((0.98, 0.98, 0.98), (0.14, 0.34, 0.62), 2)
    paint("tile-a.png", 128, 128, tile((0.98, 0.98, 0.98), (0, 0, 0), 1), 4)
    paint("tile-b.png", 256, 256, fitted(pattern, 128, 128, 256, 256), 8)

    digits = []
    for k in range(10):
        a = FIRST_HOLE + pi / 6 * k
        px, py = 128 + 0.0272 / 0.04 * 128 * sin(a), 128 + 0.0272 / 0.04 * 128 * cos(a)
        digits += letters(str((k + 1) % 10), px, py + 10, 20, 4.2, 0.65, serif=0)
    ink = Ink(digits)
    paint("dial.png", 256, 256, lambda x, y: mix((0.96, 0.95, 0.90), (0.05, 0.05, 0.06), ink.at(x, y)), 8)
    card = Ink(letters("LIVING", 64, 46, 15, 2.4, 0.6, serif=0) + letters("ROOM", 64, 70, 15, 2.4, 0.6, serif=0)
               + letters("6837", 64, 102, 22, 3.4, 0.6, serif=0))
    paint("dial-card.png", 128, 128, lambda x, y: mix((0.93, 0.88, 0.74), (0.35, 0.08, 0.06), card.at(x, y)), 8)

    book_cover()
    paint("pages.png", 64, 128, lambda x, y: ((lambda k: (k, k * 0.985, k * 0.95))(0.80 + 0.20 * hashed(0, y, 8) - 0.05 * hashed(x, y, 9))), 8)

    def weave(x, y):
        k = 0.86 + 0.10 * hashed(x, y // 2, 31) + 0.10 * hashed(x // 2, y, 32) - 0.10 * noise(x / 16, y / 16, 8, 8, 33)
        return (k, k, k)
    paint("fabric.png", 128, 128, weave, 8)

    def leather(x, y):
        k = 0.80 + 0.16 * noise(x / 16, y / 16, 8, 8, 35) + 0.10 * noise(x / 4, y / 4, 32, 32, 36) - 0.08 * (noise(x / 2, y / 2, 64, 64, 37) > 0.8)
        return (k, k * 0.98, k * 0.95)
    paint("leather.png", 128, 128, leather, 8)

    def globe(x, y):
        u, v = x / 128, y / 64
        n = 0.6 * noise(u * 6, v * 3, 6, 0, 41) + 0.3 * noise(u * 16, v * 8, 16, 0, 42) + 0.1 * noise(u * 32, v * 16, 32, 0, 43)
        grid = min((u * 12) % 1, (v * 6) % 1) < 0.06
        c = (0.95, 0.86, 0.58) if n > 0.53 else (0.55, 0.72, 0.80)
        return tuple(k * (0.85 if grid else 1) for k in c)
    paint("globe.png", 128, 64, globe, 8)
    paint("rug.png", 256, 512, fitted(rug_pattern, 228, 300, 256, 512), 16)
    paint("painting.png", 256, 256, fitted(landscape, 292, 196, 256, 256), 8)
    for name, ink in (("print-lens.png", lens_drawing()), ("print-eye.png", eye_drawing())):
        paint(name, 128, 256, fitted(lambda x, y: engraving(x, y, ink), 144, 192, 128, 256), 8)
    paint("garden.png", 512, 128, fitted(garden, 512, 107, 512, 128), 8)



def book_cover():
    """The textbook that the 1999 paper names, as gilt lettering on red cloth: drawn 448 x 325 for the cover and
    448 x 92 for the spine. The design is ours."""
    gold = (0.93, 0.77, 0.40)
    wide, high = 448, 325

    def cloth(x, y, seed):
        k = 0.90 + 0.10 * hashed(x // 2, y, seed) + 0.06 * hashed(x, y // 2, seed + 1)
        return (0.46 * k, 0.065 * k, 0.060 * k)
    ink = letters("MODERN", wide / 2, 68, 32, 6.0) + letters("OPTICAL", wide / 2, 112, 32, 6.0)
    ink += letters("ENGINEERING", wide / 2, 156, 32, 6.0)
    ink += letters("WARREN J. SMITH", wide / 2, 290, 15, 3.0, 0.7, serif=0.6)
    for m, w in ((12, 2.5), (18, 1.2)):
        corners = [(m, m), (wide - m, m), (wide - m, high - m), (m, high - m), (m, m)]
        ink += [(*a, *b, w) for a, b in zip(corners, corners[1:])]
    middle = 217
    for s in (-1, 1):   # a biconvex lens: two arcs, and rays that meet behind it
        arc = [(wide / 2 + s * (64 - 84 * cos(a)) * -1, middle + 84 * sin(a)) for a in (0.028 * k - 0.56 for k in range(41))]
        ink += [(*a, *b, 2.4) for a, b in zip(arc, arc[1:])]
        for h in (16, 32):
            ink += [(wide / 2 - 130, middle + s * h, wide / 2, middle + s * h, 1.3), (wide / 2, middle + s * h, wide / 2 + 130, middle - s * h * 0.08, 1.3)]
    ink.append((wide / 2 - 140, middle, wide / 2 + 140, middle, 1.0))
    cover = Ink(ink)
    paint("book-cover.png", 512, 512, fitted(lambda x, y: mix(cloth(x, y, 1), gold, cover.at(x, y)), wide, high, 512, 512), 16)
    ink = letters("MODERN OPTICAL", 201, 36, 22, 5.0, 0.5) + letters("ENGINEERING", 201, 78, 32, 7.0, 0.5)
    ink += letters("SMITH", 411, 51, 8.5, 1.8, 0.7, serif=0.3)
    for x, w in ((12, 3.0), (18, 1.2), (384, 1.2), (390, 3.0), (432, 3.0), (438, 1.2)):
        ink.append((x, 0, x, 92, w))
    spine = Ink(ink)
    paint("book-spine.png", 512, 128, fitted(lambda x, y: mix(cloth(x, y, 3), gold, spine.at(x, y)), wide, 92, 512, 128), 16)


def rug_pattern(x, y):
    """A field with a medallion, two guard stripes and a border of rosettes; x, y in pixels of 228 x 300."""
    u, v = x - 113.5, y - 149.5
    d = min(113.5 - abs(u), 149.5 - abs(v))
    red, blue, cream, gold = (0.46, 0.10, 0.09), (0.10, 0.15, 0.27), (0.82, 0.74, 0.58), (0.66, 0.46, 0.20)
    wear = 0.86 + 0.10 * noise(x / 30, y / 30, 0, 0, 51) + 0.08 * hashed(int(1.5 * x), int(y), 52)

    def rosette(cx, cy, r):
        a, q = atan2(cy, cx), hypot(cx, cy)
        return q < r * (0.78 + 0.22 * cos(6 * a))
    if d < 5:
        c = blue
    elif d < 8 or 32 <= d < 35:
        c = gold if (int(x + y) // 3) % 2 else cream
    elif d < 32:
        along, across = (u, 20 - d) if 149.5 - abs(v) < 113.5 - abs(u) else (v, 20 - d)
        cell = (along + 1000) % 24 - 12
        c = blue
        if rosette(cell, across, 9):
            c = cream
        if rosette(cell, across, 5.5):
            c = red
        if hypot(cell, across) < 2:
            c = gold
        if abs(abs(cell) - 12) < 1.6 and abs(across) < 4:
            c = gold
    else:
        c = red
        lozenge = abs(u) / 62 + abs(v) / 92
        wave = lozenge + 0.05 * cos(10 * atan2(v * 0.67, u))
        gx, gy = (abs(u) + 9) % 18 - 9, (abs(v) + 9) % 18 - 9
        if wave > 1.06 and rosette(gx, gy, 4.2):
            c = gold if (int((abs(u) + 9) / 18) + int((abs(v) + 9) / 18)) % 2 else cream
        corner = (78.5 - abs(u)) / 58 + (114.5 - abs(v)) / 70
        if corner < 0.62:
            c = blue if corner < 0.56 else cream
            if corner < 0.50 and rosette(gx, gy, 4.2):
                c = gold
        if wave < 1.0:
            c = cream
        if wave < 0.95:
            c = blue
            if rosette(gx, gy, 4.0):
                c = gold
        if wave < 0.56:
            c = cream
        if wave < 0.52:
            c = red
        if rosette(u, v * 0.8, 30):
            c = gold
        if rosette(u, v * 0.8, 26):
            c = blue
        if rosette(u, v * 0.8, 15):
            c = cream
        if rosette(u, v * 0.8, 7):
            c = red
    return tuple(k * wear for k in c)


def landscape(x, y):
    """A lake under evening clouds, in broad strokes; x, y in pixels of 292 x 196."""
    bx = x + 5 * (noise(x / 5, y / 3, 0, 0, 61) - 0.5)
    by = y + 4 * (noise(x / 6, y / 4, 0, 0, 62) - 0.5)
    u, v = bx / 292, by / 196
    horizon = 0.56

    def sky(u, v):
        c = mix((0.40, 0.53, 0.66), (0.95, 0.78, 0.52), clamp(v / horizon) ** 1.4)
        cloud = 0.55 * noise(u * 5, v * 11, 0, 0, 63) + 0.30 * noise(u * 11, v * 24, 0, 0, 64) + 0.15 * noise(u * 26, v * 50, 0, 0, 65)
        c = mix(c, (0.96, 0.90, 0.80), smooth(0.48, 0.72, cloud))
        return mix(c, (1.0, 0.93, 0.70), exp(-((u - 0.66) ** 2 + (v - 0.46) ** 2) / 0.006))
    far = horizon - 0.10 - 0.07 * noise(u * 4, 0, 0, 0, 66) - 0.03 * noise(u * 12, 0, 0, 0, 67)
    near = horizon - 0.02 - 0.10 * smooth(0.50, 0.0, u) * (0.6 + 0.6 * noise(u * 18, 0, 0, 0, 68))
    if v < far:
        c = sky(u, v)
    elif v < near and v < horizon:
        c = mix((0.36, 0.42, 0.50), (0.52, 0.50, 0.48), clamp((v - far) / 0.14))
    elif v < horizon:
        c = mix((0.16, 0.22, 0.13), (0.30, 0.34, 0.16), noise(u * 40, v * 40, 0, 0, 69))
    else:
        c = mix(sky(u, 2 * horizon - v), (0.26, 0.36, 0.42), 0.35)
        c = mix(c, (0.93, 0.86, 0.70), 0.5 * smooth(0.62, 0.85, noise(u * 9, v * 70, 0, 0, 70)))
        shore = 0.90 - 0.12 * noise(u * 3, 0, 0, 0, 71) + 0.10 * abs(u - 0.6)
        if v > shore:
            c = mix((0.24, 0.26, 0.11), (0.50, 0.44, 0.18), noise(u * 50, v * 30, 0, 0, 72))
    if abs(u - 0.17 + 0.02 * sin(6 * v)) < 0.006 + 0.010 * smooth(0.3, 0.95, v) and 0.3 < v < 0.93:
        c = (0.20, 0.14, 0.09)
    crown = hypot((u - 0.16) / 0.13, (v - 0.25) / 0.22) + 0.5 * (noise(u * 22, v * 18, 0, 0, 73) - 0.5)
    if crown < 0.92:
        c = mix((0.15, 0.21, 0.09), (0.50, 0.50, 0.20), clamp(noise(u * 45, v * 36, 0, 0, 74) * 1.2 + 0.5 * (u - 0.16)))
    return tuple(k * (0.94 + 0.10 * hashed(x // 2, y, 75)) for k in c)



def engraving(x, y, ink):
    """Ink on old paper inside a mat; x, y in pixels of 144 x 192."""
    d = min(x, y, 143 - x, 191 - y)
    paper = mix((0.90, 0.86, 0.74), (0.80, 0.72, 0.56), 0.7 * noise(x / 30, y / 30, 0, 0, 95))
    c = (0.93, 0.92, 0.88) if d < 20 else mix(paper, (0.20, 0.15, 0.12), 0.9 * ink.at(x, y))
    return times(c, 0.75) if 19.5 <= d < 20.5 else c


def arcs(x, y, radius, middle, half, width, steps=14):
    """Segments of an arc about (x, y), `half` radians to both sides of the direction `middle`."""
    points = [(x + radius * cos(middle + half * (2 * k / steps - 1)), y + radius * sin(middle + half * (2 * k / steps - 1))) for k in range(steps + 1)]
    return [(*a, *b, width) for a, b in zip(points, points[1:])]


def lens_drawing():
    """Four lens elements on an axis, with rays, and a caption."""
    ink = [(32, 86, 112, 86, 0.7)] + letters("OBJECTIVE", 72, 158, 7, 1.3, 0.7, serif=0)
    for x, radius, half_height in ((44, 40, 26), (56, 30, 22), (84, -30, 22), (98, -40, 26)):
        a = atan2(half_height, abs(radius))
        ink += arcs(x + radius, 86, abs(radius), pi if radius > 0 else 0, a, 1.2)
        back = x + (7 if radius > 0 else -7)
        ink += arcs(back + 2.2 * radius, 86, abs(2.2 * radius), pi if radius > 0 else 0, a / 2.15, 1.2)
    for h in (-18, -9, 9, 18):
        ink += [(28, 86 + h, 50, 86 + h, 0.7), (50, 86 + h, 72, 86 + 0.5 * h, 0.7), (72, 86 + 0.5 * h, 92, 86 + 0.55 * h, 0.7), (92, 86 + 0.55 * h, 116, 86, 0.7)]
    return Ink(ink + [(72, 62, 72, 74, 1.6), (72, 98, 72, 110, 1.6)])


def eye_drawing():
    """An eye in section, with a pencil of light, and a caption."""
    ink = arcs(80, 88, 30, 0, pi, 1.4, 48) + arcs(58, 88, 15, pi, 0.95, 1.2) + arcs(84, 88, 30, pi, 0.42, 1.0) + arcs(42, 88, 22, 0, 0.58, 1.0)
    ink += letters("OCULUS", 72, 158, 7, 1.3, 0.7, serif=0) + arcs(80, 88, 27.5, 0, 2.0, 0.6, 36)
    for h in (-8, 0, 8):
        ink += [(28, 88 + 1.4 * h, 58, 88 + h, 0.7), (58, 88 + h, 109, 88, 0.7)]
    return Ink(ink + [(109, 84, 118, 80, 2.2), (110, 92, 118, 97, 2.2)])


def garden(x, y):
    """Sky over trees, a hedge and a lawn, soft because it is far; x, y in pixels of 512 x 107 for 66 x 13.8 m."""
    u, up = x / 512, 9.8 - 13.8 * (y + 0.5) / 107
    c = mix((0.93, 0.95, 0.97), (0.60, 0.77, 0.95), clamp((up - 1.0) / 8))
    c = mix(c, (1, 1, 1), smooth(0.45, 0.75, 0.6 * noise(u * 14, up * 0.5, 0, 0, 81) + 0.4 * noise(u * 34, up, 0, 0, 82)))
    leaf = 0.5 * noise(u * 190, up * 3, 0, 0, 85) + 0.5 * noise(u * 80, up * 1.3, 0, 0, 86)
    far = 3.2 + 2.6 * noise(u * 12, 0.5, 0, 0, 83) + 0.9 * noise(u * 48, 0.5, 0, 0, 84)
    near = 0.2 + 6.5 * max(0.0, noise(u * 16, 0.5, 0, 0, 87) - 0.45) + 0.6 * noise(u * 60, 0.5, 0, 0, 88)
    c = mix(c, mix((0.48, 0.58, 0.46), (0.66, 0.74, 0.56), leaf), smooth(far + 0.3, far - 0.3, up))
    c = mix(c, mix((0.26, 0.38, 0.18), (0.55, 0.66, 0.34), leaf), smooth(near + 0.2, near - 0.2, up))
    return mix(c, mix((0.48, 0.62, 0.30), (0.64, 0.75, 0.42), leaf), smooth(-0.6, -0.9, up))


if __name__ == "__main__":
    if "-notextures" not in sys.argv:
        make_textures()
    for part in (room, window, curtain, outside, table, telephone, telephone_line, book, lamp, sofa, armchair, bookshelf, sideboard, rug, picture, prints, plant):
        part()
    print("bytes by part:", TOTALS, "sum", sum(TOTALS.values()))
