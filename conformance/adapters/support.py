"""What the adapters share: running programs, and reading pictures."""

import math
import subprocess
import zlib

from run import Failed


def run(*words, seconds=30):
    """Runs a program. One that a signal ends, or that does not end, fails."""
    try:
        done = subprocess.run([str(w) for w in words], capture_output=True, text=True, errors="replace",
                              timeout=seconds)
    except subprocess.TimeoutExpired:
        raise Failed(f"not done after {seconds} s") from None
    if done.returncode < 0:
        raise Failed(f"signal {-done.returncode} ends the program")
    return done


def ppm(path):
    """Returns a function that gives the color of a pixel of a PPM file of 8 bits, or None; removes the file."""
    if not path.exists():
        return None
    data = path.read_bytes()
    path.unlink()
    words, at = [], 0
    while len(words) < 4:
        while data[at:at + 1].isspace():
            at += 1
        if data[at:at + 1] == b"#":
            at = data.index(b"\n", at)
            continue
        end = at
        while not data[end:end + 1].isspace():
            end += 1
        words.append(data[at:end])
        at = end
    width, start = int(words[1]), at + 1
    return lambda x, y: tuple(data[start + 3 * (width * y + x):][:3])


def direction(axis, angle):
    """Returns 0 0 -1 turned about an axis."""
    length = math.sqrt(sum(a * a for a in axis)) or 1
    x, y, z = (a / length for a in axis)
    c, s = math.cos(angle), math.sin(angle)
    return [-x * z * (1 - c) - y * s, -y * z * (1 - c) + x * s, -z * z * (1 - c) - c]


def png(path):
    """Returns a function that gives the color of a pixel of a PNG file of 8 bits a component, or None; removes it."""
    if not path.exists():
        return None
    data, at, packed = path.read_bytes(), 8, b""
    path.unlink()
    while data[at + 4:at + 8] != b"IEND":
        length = int.from_bytes(data[at:at + 4], "big")
        if data[at + 4:at + 8] == b"IDAT":
            packed += data[at + 8:at + 8 + length]
        at += length + 12
    width, height = (int.from_bytes(data[i:i + 4], "big") for i in (16, 20))
    size = {0: 1, 2: 3, 4: 2, 6: 4}[data[25]]
    raw, rows, above = zlib.decompress(packed), [], bytes(width * size)
    for y in range(height):
        start = y * (width * size + 1)
        above = unfiltered(raw[start], raw[start + 1:start + 1 + width * size], above, size)
        rows.append(above)
    shown = (0, 1, 2) if size > 2 else (0, 0, 0)
    return lambda x, y: tuple(rows[y][size * x + i] for i in shown)


def unfiltered(kind, row, above, size):
    """Returns a row of a PNG file without its filter."""
    out = bytearray(row)
    for i in range(len(out)):
        left, up = (out[i - size], above[i - size]) if i >= size else (0, 0)
        guess = left + above[i] - up
        near = min((left, above[i], up), key=lambda value: abs(guess - value))
        out[i] = (out[i] + (0, left, above[i], (left + above[i]) // 2, near)[kind]) & 255
    return bytes(out)
