"""Paints over a photograph where a mask is black: python prepare.py PHOTOGRAPH MASK OUTPUT. Needs Pillow."""
import sys

from PIL import Image

CLIPBOARD = 70  # the level of the clipboard in left02.jpg

photograph, mask, output = sys.argv[1:]
picture = Image.open(photograph).convert("L")
counts = Image.open(mask).convert("L").point(lambda level: 255 if level > 127 else 0)
Image.composite(picture, Image.new("L", picture.size, CLIPBOARD), counts).save(output)
