"""What the adapters share: running programs, and reading pictures."""

import math
import subprocess


def run(*words, seconds=30):
    """Runs a program; a time limit ends as a failure without output."""
    try:
        return subprocess.run([str(w) for w in words], capture_output=True, text=True, errors="replace",
                              timeout=seconds)
    except subprocess.TimeoutExpired:
        return subprocess.CompletedProcess(words, 1, "", f"not done after {seconds} s")


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
