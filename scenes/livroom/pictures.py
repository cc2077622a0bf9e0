"""Small textures for the living room, drawn by formula and written as PNG. Standard library only."""
import struct
import zlib
from math import atan2, cos, exp, floor, hypot, pi, sin


def clamp(x, low=0.0, high=1.0):
    return low if x < low else high if x > high else x


def mix(a, b, t):
    return tuple(x + (y - x) * t for x, y in zip(a, b))


def smooth(low, high, x):
    t = clamp((x - low) / (high - low))
    return t * t * (3 - 2 * t)


def write_png(path, width, height, pixel, step=4):
    """Writes pixel(x, y) -> (r, g, b) in 0..1, y down. Levels are rounded to `step` to keep files small."""
    rows = bytearray()
    before = bytes(3 * width)
    for y in range(height):
        row = bytearray()
        for x in range(width):
            for c in pixel(x, y):
                v = int(clamp(c) * 255 / step + 0.5) * step
                row.append(min(v, 255))
        up = bytes((a - b) & 255 for a, b in zip(row, before))
        rows += (b"\x02" + up) if sum(min(v, 256 - v) for v in up) < sum(row) // 4 else b"\x00" + bytes(row)
        before = bytes(row)

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    with open(path, "wb") as out:
        out.write(b"\x89PNG\r\n\x1a\n")
        out.write(chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)))
        out.write(chunk(b"IDAT", zlib.compress(bytes(rows), 9)))
        out.write(chunk(b"IEND", b""))


def fitted(pixel, width, height, to_width, to_height):
    """A picture drawn for one size, asked at another: textures are powers of two, as old viewers need."""
    return lambda x, y: pixel((x + 0.5) * width / to_width - 0.5, (y + 0.5) * height / to_height - 0.5)


def hashed(i, j, seed=0):
    """A number in 0..1 that depends on two integers and nothing else."""
    i, j = int(i), int(j)
    n = (i * 374761393 + j * 668265263 + seed * 2147483647 + 1013904223) & 0xFFFFFFFF
    n = ((n ^ (n >> 13)) * 1274126177) & 0xFFFFFFFF
    n = ((n ^ (n >> 16)) * 2246822519) & 0xFFFFFFFF
    return (n ^ (n >> 15)) / 4294967296.0


def noise(x, y, period_x=0, period_y=0, seed=0):
    """Value noise; with periods it repeats, so that the texture tiles."""
    i, j = floor(x), floor(y)
    u, v = x - i, y - j
    u, v = u * u * (3 - 2 * u), v * v * (3 - 2 * v)

    def at(a, b):
        return hashed(a % period_x if period_x else a, b % period_y if period_y else b, seed)
    top = at(i, j) + (at(i + 1, j) - at(i, j)) * u
    low = at(i, j + 1) + (at(i + 1, j + 1) - at(i, j + 1)) * u
    return top + (low - top) * v


# ---- lettering: strokes on a grid 4 wide and 6 high, y up ----

STROKES = {
    "A": "0,0 2,6 4,0|0.8,2 3.2,2", "B": "0,0 0,6 2.6,6 3.6,5.4 3.6,3.8 2.6,3.2 0,3.2|2.6,3.2 4,2.6 4,0.7 2.8,0 0,0",
    "C": "4,5 3,6 1.2,6 0,4.8 0,1.2 1.2,0 3,0 4,1", "D": "0,0 0,6 2.4,6 4,4.6 4,1.4 2.4,0 0,0",
    "E": "4,0 0,0 0,6 4,6|0,3.1 3,3.1", "F": "0,0 0,6 4,6|0,3.1 3,3.1",
    "G": "4,5 3,6 1.2,6 0,4.8 0,1.2 1.2,0 3,0 4,1 4,2.8 2.4,2.8", "H": "0,0 0,6|4,0 4,6|0,3.1 4,3.1",
    "I": "2,0 2,6", "J": "3.6,6 3.6,1.2 2.6,0 1.2,0 0.2,1.2", "K": "0,0 0,6|4,6 0,2.4|1.4,3.7 4,0",
    "L": "0,6 0,0 3.8,0", "M": "0,0 0,6 2,2 4,6 4,0", "N": "0,0 0,6 4,0 4,6",
    "O": "1.2,0 0,1.2 0,4.8 1.2,6 2.8,6 4,4.8 4,1.2 2.8,0 1.2,0", "P": "0,0 0,6 2.8,6 4,5.2 4,3.6 2.8,2.8 0,2.8",
    "Q": "1.2,0 0,1.2 0,4.8 1.2,6 2.8,6 4,4.8 4,1.2 2.8,0 1.2,0|2.6,1.6 4.2,-0.4",
    "R": "0,0 0,6 2.8,6 4,5.2 4,3.8 2.8,3 0,3|2,3 4,0", "S": "4,5 3,6 1.2,6 0,5 0,4 1,3.2 3,2.8 4,2 4,1 2.8,0 1,0 0,1",
    "T": "2,0 2,6|0,6 4,6", "U": "0,6 0,1.2 1.2,0 2.8,0 4,1.2 4,6", "V": "0,6 2,0 4,6",
    "W": "0,6 1,0 2,4 3,0 4,6", "X": "0,0 4,6|0,6 4,0", "Y": "0,6 2,3 4,6|2,3 2,0", "Z": "0,6 4,6 0,0 4,0",
    "0": "1.2,0 0.2,1.4 0.2,4.6 1.2,6 2.8,6 3.8,4.6 3.8,1.4 2.8,0 1.2,0", "1": "0.8,4.8 2.2,6 2.2,0",
    "2": "0.2,4.8 1.2,6 2.8,6 3.8,4.9 3.6,3.6 0.2,0 3.9,0", "3": "0.3,6 3.7,6 1.9,3.6 3.2,3.4 3.9,2.2 3.6,0.8 2.6,0 1,0 0.1,1",
    "4": "3,0 3,6 0,1.8 4,1.8", "5": "3.6,6 0.6,6 0.4,3.3 1.6,3.8 2.8,3.7 3.8,2.7 3.8,1.2 2.8,0 1.1,0 0.1,0.9",
    "6": "3.4,5.6 2.4,6 1.2,5.2 0.3,3.4 0.2,1.4 1.2,0 2.8,0 3.8,1.2 3.7,2.6 2.7,3.5 1.2,3.2 0.4,2.2", "7": "0.1,6 3.9,6 1.6,0",
    "8": "1.3,3.2 0.4,4.1 0.4,5.1 1.3,6 2.7,6 3.6,5.1 3.6,4.1 2.7,3.2 1.3,3.2 0.1,2 0.1,1 1.2,0 2.8,0 3.9,1 3.9,2 2.7,3.2",
    "9": "0.6,0.4 1.6,0 2.8,0.8 3.7,2.6 3.8,4.6 2.8,6 1.2,6 0.2,4.8 0.3,3.4 1.3,2.5 2.8,2.8 3.6,3.8", "&": "4,0 0.8,4.6 1,5.6 2,6 2.8,5.4 2.6,4.4 0.4,2 0.4,0.8 1.4,0 2.6,0.4 4,2.4",
    "-": "0.8,3 3.2,3", ".": "1.9,0 2.1,0", " ": "",
}


def rounded(points):
    """Cuts the corners of a stroke of more than three points twice, which makes a bowl of a polygon."""
    for _ in range(2 if len(points) > 3 else 0):
        cut = [points[0]]
        for a, b in zip(points, points[1:]):
            cut += [(0.75 * a[0] + 0.25 * b[0], 0.75 * a[1] + 0.25 * b[1]), (0.25 * a[0] + 0.75 * b[0], 0.25 * a[1] + 0.75 * b[1])]
        points = cut + [points[-1]]
    return points


def letters(text, x, y, height, thick, thin=0.4, spacing=2.0, serif=0.85):
    """Segments (x0, y0, x1, y1, width), y down, of a line of text; (x, y) is the middle of its base line.

    Upright strokes are `thick`, level ones `thin` times that, and stems end in serifs, as in a roman type.
    """
    k = height / 6
    wide = [1.0 if c in "I." else 4.0 for c in text]
    left = x - k * (sum(wide) + spacing * (len(text) - 1)) / 2
    out = []
    for letter, width in zip(text, wide):
        shift = -1.5 if width == 1.0 else 0.0

        def segment(a, b):
            run, rise = abs(b[0] - a[0]), abs(b[1] - a[1])
            weight = thick * (thin + (1 - thin) * rise / (hypot(run, rise) + 1e-9))
            out.append((left + k * (a[0] + shift), y - k * a[1], left + k * (b[0] + shift), y - k * b[1], weight))
        for stroke in filter(None, STROKES[letter].split("|")):
            points = [tuple(map(float, p.split(","))) for p in stroke.split()]
            for end, other in ((points[0], points[1]), (points[-1], points[-2])):
                if serif and end[1] in (0.0, 6.0) and abs(other[1] - end[1]) > 1.1 * abs(other[0] - end[0]):
                    segment((end[0] - serif, end[1]), (end[0] + serif, end[1]))
            points = rounded(points)
            for a, b in zip(points, points[1:]):
                segment(a, b)
        left += k * (width + spacing)
    return out


class Ink:
    """Strokes (x0, y0, x1, y1, width), asked pixel by pixel how much ink lies there."""

    def __init__(self, segments, cell=8):
        self.cells, self.cell = {}, cell
        for s in segments:
            m = s[4] / 2 + 1
            for i in range(floor((min(s[0], s[2]) - m) / cell), floor((max(s[0], s[2]) + m) / cell) + 1):
                for j in range(floor((min(s[1], s[3]) - m) / cell), floor((max(s[1], s[3]) + m) / cell) + 1):
                    self.cells.setdefault((i, j), []).append(s)

    def at(self, x, y):
        x, y = x + 0.5, y + 0.5
        most = 0.0
        for x0, y0, x1, y1, width in self.cells.get((floor(x / self.cell), floor(y / self.cell)), ()):
            dx, dy = x1 - x0, y1 - y0
            t = clamp(((x - x0) * dx + (y - y0) * dy) / (dx * dx + dy * dy + 1e-12))
            most = max(most, width / 2 - hypot(x - x0 - t * dx, y - y0 - t * dy) + 0.5)
        return clamp(most)
