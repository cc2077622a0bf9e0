"""Checks that positions of `ivcam compare --align` are those of OpenCV, scikit-image and Pillow.

    python crates/measure/pixel_centers.py IVCAM PICTURE...

Each picture is resized by each program to four fifths of its width and height, and aligned with itself. The
programs put the centers of the first pixels half a pixel from the corner, so that the shift is 0 and the scale the
ratio of the sizes. A row of the table is in stated standard errors, and the last column the largest error at a
corner of the picture in its pixels.
"""

import json
import subprocess
import sys
import tempfile
from pathlib import Path

import cv2
import numpy as np
import skimage.transform
from PIL import Image


def resizers(size):
    """Returns functions that resize an array of H × W × 3 bytes to a size (width, height)."""
    width, height = size
    by_opencv = {"area": cv2.INTER_AREA, "linear": cv2.INTER_LINEAR, "cubic": cv2.INTER_CUBIC}
    found = {
        f"OpenCV, {name}": lambda a, flag=flag: cv2.resize(a, size, interpolation=flag)
        for name, flag in by_opencv.items()
    }
    found["scikit-image, resize"] = lambda a: np.round(
        255 * skimage.transform.resize(a, (height, width), anti_aliasing=True)
    ).astype(np.uint8)
    found["Pillow, Lanczos"] = lambda a: np.asarray(Image.fromarray(a).resize(size, Image.LANCZOS))
    return found


def main(ivcam, pictures):
    print("| picture | resized by | shift x | shift y | scale | rotation | corner |\n|---|---|---|---|---|---|---|")
    for path in pictures:
        picture = np.asarray(Image.open(path).convert("RGB"))
        height, width = picture.shape[:2]
        width, height = width // 5 * 5, height // 5 * 5
        picture = np.ascontiguousarray(picture[:height, :width])
        size = (width * 4 // 5, height * 4 // 5)
        for name, resize in resizers(size).items():
            with tempfile.TemporaryDirectory() as folder:
                new, old = Path(folder, "new.png"), Path(folder, "old.png")
                Image.fromarray(picture).save(new)
                Image.fromarray(resize(picture)).save(old)
                command = [ivcam, "compare", new, old, "--align", "--json"]
                answer = subprocess.run(command, capture_output=True, check=True)
            a = json.loads(answer.stdout)["alignment"]
            x, y = (v / a["shift_error"] for v in a["shift"])
            scale = (a["scale"] - 1.25) / a["scale_error"]
            turn = a["rotation"] / a["rotation_error"]
            reach = np.hypot(width, height) / 2
            bent = np.hypot(a["scale"] / 1.25 - 1, np.radians(a["rotation"]))
            corner = np.hypot(*a["shift"]) + reach * bent
            name = f"{Path(path).stem} | {name}"
            print(f"| {name} | {x:+.1f} | {y:+.1f} | {scale:+.1f} | {turn:+.1f} | {corner:.3f} px |")


if __name__ == "__main__":
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    main(sys.argv[1], sys.argv[2:])
