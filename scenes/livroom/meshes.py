"""Shapes for the living room as polygon meshes, and the text of Inventor nodes.

Lengths are meters, y is up. A mesh is a list of points, a list of faces that run counterclockwise
seen from outside, and, if it wears a texture, one texture coordinate a point. Standard library only;
nothing is random, so the same script writes the same bytes.
"""
from math import cos, hypot, pi, sin, sqrt, tan


def number(x, digits=4):
    """A number as short as it can be written: 0.1 mm is the default resolution."""
    text = f"{x:.{digits}f}".rstrip("0").rstrip(".")
    return "0" if text in ("", "-0") else text


def vector(v, digits=4):
    return " ".join(number(x, digits) for x in v)


def add(a, b):
    return tuple(x + y for x, y in zip(a, b))


def sub(a, b):
    return tuple(x - y for x, y in zip(a, b))


def times(a, k):
    return tuple(x * k for x in a)


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def unit(a):
    length = sqrt(dot(a, a))
    return times(a, 1 / length) if length else a


class Mesh:
    def __init__(self, points=None, faces=None, uv=None):
        self.points, self.faces, self.uv = points or [], faces or [], uv

    def join(self, other):
        base = len(self.points)
        self.points += other.points
        self.faces += [tuple(i + base for i in f) for f in other.faces]
        if other.uv:
            self.uv = (self.uv or []) + other.uv
        return self

    def map(self, move):
        return Mesh([move(p) for p in self.points], list(self.faces), self.uv and list(self.uv))

    def moved(self, x, y, z):
        return self.map(lambda p: (p[0] + x, p[1] + y, p[2] + z))

    def turned(self, axis, angle):
        c, s = cos(angle), sin(angle)
        a, b = {"x": (1, 2), "y": (2, 0), "z": (0, 1)}[axis]

        def turn(p):
            q = list(p)
            q[a], q[b] = c * p[a] - s * p[b], s * p[a] + c * p[b]
            return tuple(q)
        return self.map(turn)

    def outward(self):
        """Turns a closed mesh right side out: its signed volume must be positive."""
        volume = 0.0
        for f in self.faces:
            for i in range(1, len(f) - 1):
                a, b, c = (self.points[k] for k in (f[0], f[i], f[i + 1]))
                volume += dot(a, cross(b, c))
        if volume < 0:
            self.faces = [f[::-1] for f in self.faces]
        return self

    def welded(self, grain=1e-6):
        """Makes points that coincide one point, so that normals are smooth across the seam."""
        seen, index, points = {}, [], []
        for p in self.points:
            key = tuple(round(x / grain) for x in p)
            if key not in seen:
                seen[key] = len(points)
                points.append(p)
            index.append(seen[key])
        faces = []
        for f in self.faces:
            g = [index[i] for i in f]
            g = [v for k, v in enumerate(g) if v != g[k - 1]]
            if len(g) > 2:
                faces.append(tuple(g))
        return Mesh(points, faces)


def grid_faces(rows, columns, wrap=False, base=0):
    """Faces of a grid of points stored row by row; `wrap` joins the last column to the first."""
    faces = []
    for i in range(rows - 1):
        for j in range(columns if wrap else columns - 1):
            k = (j + 1) % columns
            a, b = base + i * columns, base + (i + 1) * columns
            faces.append((a + j, a + k, b + k, b + j))
    return faces


def lathe(profile, sides=32):
    """Turns (radius, height) pairs round the y axis; a radius of 0 closes the end in one point."""
    points, rows = [], []
    for r, y in profile:
        if r == 0:
            rows.append([len(points)])
            points.append((0, y, 0))
        else:
            rows.append(list(range(len(points), len(points) + sides)))
            points += [(r * sin(2 * pi * k / sides), y, r * cos(2 * pi * k / sides)) for k in range(sides)]
    faces = []
    for low, high in zip(rows, rows[1:]):
        for j in range(sides):
            k = (j + 1) % sides
            if len(low) == 1 and len(high) == 1:
                continue
            if len(low) == 1:
                faces.append((low[0], high[k], high[j]))
            elif len(high) == 1:
                faces.append((low[j], low[k], high[0]))
            else:
                faces.append((low[j], low[k], high[k], high[j]))
    return Mesh(points, faces)


def loft(sections, caps=True):
    """Skins closed sections with equal numbers of points, from the first to the last."""
    n = len(sections[0])
    mesh = Mesh([p for s in sections for p in s], grid_faces(len(sections), n, wrap=True))
    if caps:
        last = (len(sections) - 1) * n
        mesh.faces.append(tuple(range(n))[::-1])
        mesh.faces.append(tuple(range(last, last + n)))
    return mesh.outward()


def rounded_rectangle(width, depth, radius, steps=6):
    """Points (x, z) round a rectangle with rounded corners, centered on the origin."""
    points = []
    for corner in range(4):
        sx, sz = ((1, 1), (-1, 1), (-1, -1), (1, -1))[corner]
        for k in range(steps + 1):
            a = pi / 2 * (corner + k / steps)
            points.append((sx * (width / 2 - radius) + radius * cos(a), sz * (depth / 2 - radius) + radius * sin(a)))
    return points


def rounded_box(size, radius, steps=3, middle=1, bulge=(0, 0, 0)):
    """A box with rounded edges, centered on the origin. `bulge` blows the faces across x, y and z out."""
    half = [s / 2 for s in size]
    inner = [h - radius for h in half]
    ticks = [(-1, tan(pi / 4 * (k / steps - 1))) for k in range(steps + 1)]
    flat = [(-1 + 2 * k / middle, 0.0) for k in range(1, middle)]
    ticks = ticks + flat + [(1, -t) for _, t in ticks[::-1]]
    mesh = Mesh()
    n = len(ticks)
    for axis in range(3):
        for side in (-1, 1):
            a, b = (axis + 1) % 3, (axis + 2) % 3
            points = []
            for ca, ta in ticks:
                for cb, tb in ticks:
                    q, d = [0, 0, 0], [0, 0, 0]
                    q[axis], q[a], q[b] = side * inner[axis], ca * inner[a], cb * inner[b]
                    d[axis], d[a], d[b] = side, ta, tb
                    d = unit(d)
                    points.append(tuple(q[i] + radius * d[i] for i in range(3)))
            faces = grid_faces(n, n)
            mesh.join(Mesh(points, faces if side > 0 else [f[::-1] for f in faces]))
    mesh = mesh.welded()
    if any(bulge):
        def puff(p):
            s = [p[i] / half[i] for i in range(3)]
            w = [max(0.0, 1 - x * x) for x in s]
            return tuple(p[i] + bulge[i] * s[i] * w[(i + 1) % 3] * w[(i + 2) % 3] for i in range(3))
        mesh = mesh.map(puff)
    return mesh.outward()


def curve(knots, steps=8):
    """A smooth curve through knots (Catmull-Rom)."""
    p = [knots[0]] + list(knots) + [knots[-1]]
    out = []
    for i in range(1, len(p) - 2):
        for k in range(steps):
            t = k / steps
            a, b, c, d = p[i - 1], p[i], p[i + 1], p[i + 2]
            out.append(tuple(0.5 * (2 * b[j] + (c[j] - a[j]) * t
                                    + (2 * a[j] - 5 * b[j] + 4 * c[j] - d[j]) * t * t
                                    + (3 * b[j] - a[j] - 3 * c[j] + d[j]) * t ** 3) for j in range(len(b))))
    return out + [tuple(knots[-1])]


def sweep(path, section, scale=None, caps=True, up=(0, 1, 0)):
    """Carries a section (x, y) along a path without twisting it more than the path does.

    `scale(t)` sizes the section at t from 0 to 1 along the path: a number, or a pair.
    """
    n = len(path)
    tangents = [unit(sub(path[min(i + 1, n - 1)], path[max(i - 1, 0)])) for i in range(n)]
    side = unit(cross(up, tangents[0]))
    if dot(side, side) < 0.5:
        side = unit(cross((0, 0, 1), tangents[0]))
    rows = []
    for i, (p, t) in enumerate(zip(path, tangents)):
        side = unit(sub(side, times(t, dot(side, t))))
        top = cross(t, side)
        s = scale(i / (n - 1)) if scale else 1
        sx, sy = s if isinstance(s, tuple) else (s, s)
        rows.append([add(p, add(times(side, x * sx), times(top, y * sy))) for x, y in section])
    return loft(rows, caps)


def ring(radius, sides=10, flatten=1.0):
    return [(radius * cos(2 * pi * k / sides), radius * flatten * sin(2 * pi * k / sides)) for k in range(sides)]


def extrude(outline, z0, z1):
    """A prism over a convex or concave outline (x, y), from z0 to z1."""
    return loft([[(x, y, z0) for x, y in outline], [(x, y, z1) for x, y in outline]])


def sheet(rows, columns, place, uv=True):
    """A surface from place(u, v), u across and v up, both from 0 to 1."""
    at = [(j / (columns - 1), i / (rows - 1)) for i in range(rows) for j in range(columns)]
    return Mesh([place(u, v) for u, v in at], grid_faces(rows, columns), at if uv else None)


# ---- Inventor text ----

def indent(text, by="  "):
    return "\n".join(by + line if line else line for line in text.split("\n"))


def wrap(items, width=118):
    """Joins items with commas, breaking lines before they grow too long."""
    lines, line = [], ""
    for item in items:
        if line and len(line) + len(item) + 2 > width:
            lines.append(line)
            line = ""
        line += item + ","
    lines.append(line.rstrip(","))
    return "\n".join(lines)


def group(name, *children, kind="Separator"):
    head = f"DEF {name} {kind} {{" if name else f"{kind} {{"
    return head + "\n" + "\n".join(indent(c) for c in children) + "\n}"


def material(color, specular=0.0, shininess=0.2, emissive=None, transparency=0.0, ambient=None):
    """A Material whose ambient color is its diffuse color, so that shade has the object's own hue.

    `specular` is a gray level or a color; it is also what a recursive shader reflects.
    """
    spec = specular if isinstance(specular, tuple) else (specular,) * 3
    lines = [f"ambientColor {vector(ambient or color)}", f"diffuseColor {vector(color)}"]
    if any(spec):
        lines += [f"specularColor {vector(spec)}", f"shininess {number(shininess)}"]
    if emissive:
        lines.append(f"emissiveColor {vector(emissive)}")
    if transparency:
        lines.append(f"transparency {number(transparency)}")
    return "Material { " + "  ".join(lines) + " }"


def texture(file, repeat="REPEAT"):
    wrapping = "" if repeat == "REPEAT" else f" wrapS {repeat} wrapT {repeat}"
    return f'Texture2 {{ filename "{file}"{wrapping} }}'


def hints(crease, concave=False):
    face = " faceType UNKNOWN_FACE_TYPE" if concave else ""
    return f"ShapeHints {{ vertexOrdering COUNTERCLOCKWISE{face} creaseAngle {number(crease)} }}"


def surface(mesh, crease=0.6, digits=4, name=None, *before, concave=False):
    """A mesh as ShapeHints, Coordinate3, perhaps TextureCoordinate2, and IndexedFaceSet."""
    parts = list(before) + [hints(crease, concave)]
    parts.append("Coordinate3 { point [\n" + indent(wrap(vector(p, digits) for p in mesh.points)) + " ] }")
    if mesh.uv:
        parts.append("TextureCoordinate2 { point [\n" + indent(wrap(vector(p, 3) for p in mesh.uv)) + " ] }")
    index = wrap(",".join(map(str, f)) + ",-1" for f in mesh.faces)
    parts.append("IndexedFaceSet { coordIndex [\n" + indent(index) + " ] }")
    return group(name, *parts)


def quad_mesh(rows, columns, mesh):
    """A sheet as QuadMesh: no indices, rows of vertices."""
    parts = ["Coordinate3 { point [\n" + indent(wrap(vector(p) for p in mesh.points)) + " ] }"]
    if mesh.uv:
        parts.append("TextureCoordinate2 { point [\n" + indent(wrap(vector(p) for p in mesh.uv)) + " ] }")
    parts.append(f"QuadMesh {{ verticesPerColumn {rows} verticesPerRow {columns} }}")
    return "\n".join(parts)


def cube(width, height, depth):
    return f"Cube {{ width {number(width)} height {number(height)} depth {number(depth)} }}"


def cylinder(radius, height):
    return f"Cylinder {{ radius {number(radius)} height {number(height)} }}"


def at(x, y, z, *children, name=None, turn=None):
    """Children moved to a place; `turn` is an axis and an angle."""
    move = f"translation {vector((x, y, z))}"
    if turn:
        axis, angle = turn
        move += f" rotation {vector(axis)} {number(angle, 5)}"
    return group(name, f"Transform {{ {move} }}", *children)


def block(x0, x1, y0, y1, z0, z1, *before):
    """A Cube that fills the given ranges."""
    return at((x0 + x1) / 2, (y0 + y1) / 2, (z0 + z1) / 2, *before, cube(x1 - x0, y1 - y0, z1 - z0))
