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
    text = "\n".join(lines) + "\n\n" + group(name.upper(), *nodes) + "\n"
    with open(os.path.join(HERE, name + ".iv"), "w", encoding="ascii") as out:
        out.write(text)
    TOTALS[name] = len(text)


def paint(name, width, height, pixel, step=4):
    write_png(os.path.join(HERE, name), width, height, pixel, step)


# Materials that several parts share. A specular color is also what a recursive shader mirrors.
WALNUT = (0.36, 0.22, 0.13)
OAK = (0.62, 0.45, 0.28)
BLACK = material((0.035, 0.033, 0.035), 0.16, 0.55)
BRASS = material((0.50, 0.36, 0.14), (0.45, 0.36, 0.18), 0.5)
WHITE_PAINT = material((0.86, 0.85, 0.82), 0.03, 0.2)


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
    wallpaper = group("WALLPAPER", material((0.80, 0.74, 0.62)), texture("wallpaper.png"), hints(0),
                      group("BACK_WALL", flat_grid((x0, 0, z0), (wide, 0, 0), (0, top, 0), 19, 11, (0.6, 0.6))),
                      group("RIGHT_WALL", flat_grid((x1, 0, z0), (0, 0, deep), (0, top, 0), 23, 11, (0.6, 0.6))),
                      group("LEFT_WALL", *wall_with_holes(x0, z0, z1, top, WINDOWS)))
    floor_part = group("FLOOR", material((0.78, 0.66, 0.50), 0.05, 0.4), texture("floor.png"), hints(0),
                       flat_grid((x0, 0, z1), (wide, 0, 0), (0, 0, -deep), 19, 23, (1.2, 1.2)),
                       group(None, flat_grid((x0, 0, hall), (wide, 0, 0), (0, 0, z1 - hall), 7, 13, (1.2, 1.2))))
    ceiling = group("CEILING", material((0.88, 0.87, 0.84)), hints(0),
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
    write_part("room", f"""The empty room: floor, walls, ceiling, skirting, and the hall behind the camera.
{wide} m wide (x {x0} to {x1}), {deep} m deep (z {z0} to {z1}), {top} m high; the hall runs on to z = {hall},
so that the long lenses have room to stand back. Two window openings in the left wall.""",
               wallpaper, floor_part, ceiling, front, hall_part, skirting())


def skirting():
    """Skirting boards 110 mm high with a rounded top, 16 mm thick."""
    r = ROOM
    section = [(0, 0), (0.016, 0), (0.016, 0.085), (0.013, 0.095), (0.008, 0.100), (0.006, 0.108), (0, 0.110)]

    def run(x, z, length, angle):
        board = extrude(section, 0, length)
        return surface(board.turned("y", angle).moved(x, 0, z), 0.5)
    deep = r["z1"] - r["z0"]
    return group("SKIRTING", WHITE_PAINT,
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
    parts.append(block(-deep, 0.10, -0.035, 0.0, -w2 - 0.06, w2 + 0.06))                   # sill
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
    wood = [material((0.75, 0.60, 0.48), 0.07, 0.5), texture("walnut.png")]

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
    tiles, first = [], {}
    for i in range(8):
        for j in range(4):
            x, z = (j - 1.5) * t["pitch"], (i - 3.5) * t["pitch"]
            shade = 0.93 + 0.07 * hashed(i, j, 5)
            face = "tile-a.png" if (i + j) % 2 else "tile-b.png"
            shape = "USE TILE" if first else surface(tile, 0.5, 5, "TILE")
            first["done"] = True
            tiles.append(group(None, material((shade, shade, shade), 0.14, 0.8), texture(face),
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
        row(y, 0.204 + 2 * grow, -0.082 + -grow, 0.084 + grow, 0.022 + grow)
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
    plate = sheet(2, 2, lambda u, v: (0.0395 * (2 * u - 1), 0.0046, 0.0395 * (1 - 2 * v)))
    disc = Mesh([(0.0395 * sin(2 * pi * k / 48), 0.0046, 0.0395 * cos(2 * pi * k / 48)) for k in range(48)], [tuple(range(48))])
    disc.uv = [(0.5 + p[0] / 0.08, 0.5 - p[2] / 0.08) for p in disc.points]
    rim = lathe([(0.044, 0.0), (0.044, 0.0052), (0.0433, 0.0064), (0.0420, 0.0068), (0.0405, 0.0062), (0.0395, 0.0046)], 48)
    wheel = finger_wheel(0.0365, 0.0014).turned("y", FIRST_HOLE).moved(0, 0.0072, 0)
    hub = lathe([(0.0190, 0.0086), (0.0185, 0.0095), (0.0165, 0.0098), (0.0150, 0.0091)], 40)
    card = lathe([(0.0150, 0.0091), (0, 0.0092)], 40)
    a = FIRST_HOLE - pi / 6 * 1.55
    stop = sweep(curve([(0.0415 * sin(a), 0.0066, 0.0415 * cos(a)), (0.036 * sin(a), 0.0102, 0.036 * cos(a)),
                        (0.029 * sin(a), 0.0100, 0.029 * cos(a)), (0.0235 * sin(a + 0.09), 0.0094, 0.0235 * cos(a + 0.09))], 4),
                 ring(0.0017, 8, 0.6))
    return [group("NUMBER_PLATE", material((0.92, 0.90, 0.84), 0.06, 0.6), texture("dial.png", "CLAMP"), surface(disc, 0, 5)),
            group("DIAL_RIM", BRASS, surface(rim, 0.7, 5)),
            group("FINGER_WHEEL", material((0.09, 0.085, 0.08), 0.25, 0.6), surface(wheel, 0.4, 5)),
            group("DIAL_HUB", BRASS, surface(hub, 0.7, 5)),
            group("NUMBER_CARD", material((0.88, 0.84, 0.72)), surface(card, 0.3, 5)),
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
        piece = lathe(cup, 40).turned("z", -s * 0.22).moved(s * 0.1015, 0.1135, 0)
        parts.append(surface(piece, 0.7, 5, name))
    ribs = [lathe([(0.0329, -0.0150), (0.0337, -0.0142), (0.0337, -0.0134), (0.0329, -0.0126)], 40)
            .turned("z", -s * 0.22).moved(s * 0.1015, 0.1135, 0) for s in (-1, 1)]
    return group("HANDSET", BLACK, *parts, group("HANDSET_RINGS", BRASS, *[surface(m, 0.8, 5) for m in ribs]))


def cradle():
    neck = lathe([(0.030, 0.1115), (0.030, 0.1135), (0.022, 0.1155), (0.0155, 0.1190), (0.0150, 0.1245), (0.018, 0.1280), (0, 0.1290)], 32)
    neck = neck.map(lambda p: (1.5 * p[0], p[1], p[2] - 0.0)).moved(0, 0, 0)
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


def cord(knots, name, radius=0.0029, steps=10):
    """A twisted cord: three strands, one turn in 16 mm."""
    path = curve(knots, steps)
    lobes = 12
    section = [(radius * (1 + 0.18 * cos(3 * a)) * cos(a), radius * (1 + 0.18 * cos(3 * a)) * sin(a))
               for a in (2 * pi * k / lobes for k in range(lobes))]
    return surface(sweep(path, section), 1.2, 5, name, material((0.20, 0.13, 0.08), 0.02, 0.1))


def telephone():
    lift = "Translation { translation 0 0 -0.017 }"
    tilt = 0.5285  # the front slopes back by atan(0.049 / 0.0855)
    face = at(0, 0.0660, 0.0500, *dial(), name="DIAL", turn=((1, 0, 0), pi / 2 - tilt))
    feet = [at(sx * 0.078, 0.002, sz * 0.062, cylinder(0.011, 0.004)) for sx in (-1, 1) for sz in (-1, 1)]
    knots = [(-0.122, 0.112, -0.017), (-0.136, 0.096, -0.014), (-0.150, 0.060, -0.004), (-0.157, 0.022, 0.016),
             (-0.163, 0.0052, 0.040), (-0.178, 0.0034, 0.068), (-0.205, 0.0034, 0.074), (-0.222, 0.0034, 0.050),
             (-0.212, 0.0034, 0.012), (-0.182, 0.0034, -0.040), (-0.150, 0.0034, -0.092), (-0.100, 0.0034, -0.122),
             (-0.050, 0.0040, -0.112), (-0.036, 0.0080, -0.092), (-0.034, 0.0110, -0.076)]
    write_part("telephone", """Antique desk telephone, 0.26 m across the handset, 0.20 x 0.17 m at the base, 0.17 m high.
It faces +z; the origin is on the table under its middle. Black body, brass cradle, dial with ten holes, twisted cord.""",
               group("BODY", BLACK, surface(telephone_body(), 0.55, 5)),
               group("FEET", material((0.10, 0.09, 0.08)), *feet), face, cradle(),
               group(None, lift, handset()), cord(knots, "CORD"))


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
    pages = loft(rows)
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
    base = lathe([(0.150, 0), (0.150, 0.012), (0.146, 0.018), (0.120, 0.024), (0.060, 0.032), (0.030, 0.045), (0.018, 0.070), (0.0135, 0.10)], 48)
    knob = lathe([(0.0095, 0.70), (0.016, 0.71), (0.022, 0.73), (0.016, 0.75), (0.0095, 0.76)], 24)
    collar = lathe([(0.0095, 1.20), (0.020, 1.21), (0.024, 1.225), (0.018, 1.24), (0.016, 1.27), (0, 1.275)], 24)
    shade_out = [(0.235, 1.240), (0.150, 1.560)]
    shade = lathe([(0.232, 1.240), (0.235, 1.240), (0.236, 1.246), (0.152, 1.556), (0.150, 1.560), (0.147, 1.560), (0.232, 1.240)], 56)
    spokes = []
    for k in range(3):
        a = 2 * pi * k / 3
        spokes.append(at(0.0745 * sin(a), 1.545, 0.0745 * cos(a), "Rotation { rotation 1 0 0 1.5708 }", cylinder(0.0022, 0.149),
                         turn=((0, 1, 0), a)))
    write_part("lamp", """Floor lamp, 1.56 m high: brass foot (radius 0.15 m) and stem, linen shade open at top and bottom
(radius 0.235 m below, 0.15 m above, from 1.24 to 1.56 m). The light is in the middle of the shade at 1.40 m and
shines out of both openings; there is no bulb around it that would shadow it.""",
               group("FOOT", BRASS, surface(base, 0.5), surface(knob, 0.8), surface(collar, 0.8),
                     at(0, 0.65, 0, cylinder(0.0095, 1.15)), *spokes),
               group("SHADE", material((0.62, 0.50, 0.34), emissive=(0.55, 0.42, 0.25)), surface(shade, 0.4)))


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
    paint("walnut.png", 256, 256, wood((0.72, 0.50, 0.33), (0.32, 0.18, 0.10), 0, 3, 1), 8)
    paint("floor.png", 256, 256, wood((0.95, 0.72, 0.48), (0.62, 0.40, 0.22), 10, 11, 1), 8)

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
                petals = smooth(0.012, -0.012, abs(r - star) - 0.018)
                heart = smooth(0.012, -0.012, r - 0.085 - 0.02 * cos(8 * a + pi))
                q = hypot(0.5 - abs(u), 0.5 - abs(v))
                corner = max(smooth(0.012, -0.012, abs(q - 0.20) - 0.016), smooth(0.012, -0.012, q - 0.10))
                c = mix(c, tuple(k * (0.8 + 0.3 * cloud) for k in ink), max(petals, heart, corner))
            return c
        return pixel
    paint("tile-a.png", 128, 128, tile((0.24, 0.50, 0.52), (0, 0, 0), 1), 4)
    paint("tile-b.png", 128, 128, tile((0.90, 0.87, 0.78), (0.13, 0.30, 0.50), 2), 4)

    digits = []
    for k in range(10):
        a = FIRST_HOLE + pi / 6 * k
        px, py = 128 + 0.0272 / 0.04 * 128 * sin(a), 128 + 0.0272 / 0.04 * 128 * cos(a)
        digits += letters(str((k + 1) % 10), px, py + 10, 20)
    ink = Ink(digits, 3.4)
    paint("dial.png", 256, 256, lambda x, y: mix((0.96, 0.95, 0.90), (0.05, 0.05, 0.06), ink.at(x, y)), 8)

    def cloth(x, y, seed):
        return 0.90 + 0.10 * hashed(x // 2, y, seed) + 0.06 * hashed(x, y // 2, seed + 1)
    gold = (0.93, 0.76, 0.38)
    title = Ink(letters("GEOMETRICAL", 192, 82, 34) + letters("OPTICS", 192, 138, 40), 5.5)
    small = Ink(letters("LENSES - LIGHT - IMAGES", 192, 234, 12), 2.2)
    def frame(x, y, w, h, m):
        d = min(x - m, y - m, w - 1 - m - x, h - 1 - m - y)
        return 1.0 if 0 <= d < 2 or 4 <= d < 5 else 0.0
    def lens_mark(x, y):
        u, v = x - 192, y - 183
        d = max(hypot(u - 34, v) - 44, hypot(u + 34, v) - 44)
        axis = abs(v) < 0.8 and abs(u) < 90
        rays = any(abs(v - s * (22 if u < 0 else 22 * max(0.0, 1 - u / 80))) < 0.8 and abs(u) < 84 for s in (-1, 1)) if False else False
        return clamp(1.6 - abs(d)) if abs(d) < 1.6 else (1.0 if axis else 0.0)
    def cover(x, y):
        k = cloth(x, y, 1)
        c = (0.45 * k, 0.065 * k, 0.065 * k)
        return mix(c, gold, max(title.at(x, y), small.at(x, y), frame(x, y, 384, 278, 14), lens_mark(x, y)))
    paint("book-cover.png", 384, 278, cover, 8)
    back = Ink(letters("GEOMETRICAL OPTICS", 178, 46, 22), 4.0)
    maker = Ink(letters("VOL 1", 344, 43, 13), 2.4)
    def spine(x, y):
        k = cloth(x, y, 3)
        c = (0.43 * k, 0.06 * k, 0.06 * k)
        band = 1.0 if x in (12, 13, 14, 18, 312, 316, 317, 318, 371, 370, 369, 365) else 0.0
        return mix(c, gold, max(back.at(x, y), maker.at(x, y), band))
    paint("book-spine.png", 384, 72, spine, 8)
    paint("pages.png", 64, 128, lambda x, y: ((lambda k: (k, k * 0.985, k * 0.95))(0.80 + 0.20 * hashed(0, y, 8) - 0.05 * hashed(x, y, 9))), 8)


if __name__ == "__main__":
    if "-notextures" not in sys.argv:
        make_textures()
    for part in (room, window, table, telephone, book, lamp):
        part()
    print("bytes by part:", TOTALS, "sum", sum(TOTALS.values()))
