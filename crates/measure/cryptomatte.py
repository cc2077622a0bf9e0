"""Reads the mattes of ivcam by other programs: cryptomatte-api and OpenImageIO.

    python crates/measure/cryptomatte.py IVCAM SCENE [OPTIONS OF IVCAM]

Each name of a manifest is looked up by cryptomatte-api, which hashes it itself. The sum of all masks must be the
channel `A`, the share of the samples that meet a surface: up to rounding where everything is opaque and either fills the
picture or is seen with equal weights, as by `--lens none`. A row has the number of names and of ranks, the largest difference of the sum from `A`, and the
largest difference between a mask and the sum of the channels that OpenImageIO reads with the same identifier.
"""

import json
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
from cryptomatte_api import Cryptomatte


def channels(path):
    """Returns the channels of a file as arrays by name, and its attributes."""
    image = oiio.ImageInput.open(str(path))
    spec = image.spec()
    pixels = image.read_image(format="float")
    attributes = {a.name: a.value for a in spec.extra_attribs}
    return {name: pixels[:, :, i] for i, name in enumerate(spec.channelnames)}, attributes


def ranks(found, layer):
    """Returns the pairs of identifiers (as bits) and shares of a layer."""
    pairs = []
    for pair in range(100):
        for name, share in ("rg", "ba"):
            if f"{layer}{pair:02}.{name}" not in found:
                return pairs
            bits = np.ascontiguousarray(found[f"{layer}{pair:02}.{name}"]).view(np.uint32)
            pairs.append((bits, found[f"{layer}{pair:02}.{share}"]))


def main(ivcam, scene, options):
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "layers.exr")
        picture = Path(folder, "picture.png")
        words = [ivcam, "render", scene, *options, "--aov", path, "--layers", "cryptomatte", "-o", picture, "--quiet"]
        subprocess.run(words, check=True)
        found, attributes = channels(path)
        print("| layer | names | ranks | sum − A | mask − channels |\n|---|---|---|---|---|")
        for matte in Cryptomatte.load(str(path)):
            layer = matte.metadata().name()
            keys = [k for k, v in attributes.items() if k.startswith("cryptomatte/") and v == layer]
            manifest = json.loads(attributes[keys[0].replace("/name", "/manifest")])
            pairs = ranks(found, layer)
            total, apart = 0.0, 0.0
            for name, digits in manifest.items():
                mask = np.asarray(matte.mask(name)).reshape(found["A"].shape)
                own = sum(np.where(bits == int(digits, 16), share, 0.0) for bits, share in pairs)
                apart = max(apart, np.abs(mask - own).max())
                total = total + mask
            difference = np.abs(total - found["A"]).max()
            print(f"| {layer} | {len(manifest)} | {len(pairs)} | {difference:.1e} | {apart:.1e} |")


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2], sys.argv[3:])
