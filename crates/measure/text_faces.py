#!/usr/bin/env python3
"""Makes the shipped typefaces for characters that the twelve Latin-1 ones lack.

    pip install fonttools==4.68.0
    python crates/measure/text_faces.py GYRE DEJAVU

GYRE holds `texgyretermes-regular.otf` and the others of TeX Gyre 2.004 (Debian: fonts-texgyre 20180621), and
DEJAVU holds `DejaVuSans.ttf` and the others of DejaVu 2.37 (Debian: fonts-dejavu-core and -extra). The results
are written to crates/render/src/geometry/text/fonts, packed with gzip:

  serif-latin.otf.gz, ...   one for each of the twelve, with the other Latin letters, combining accents and
                            punctuation of the same design. Hints are kept, so that letters of both files have
                            the same heights.
  serif-other.ttf.gz, ...   Greek and Cyrillic in the style of a family.
  any-other.ttf.gz          every other script and symbol. None of these three kinds has hints.

The fonts are renamed, as the licenses ask. The same inputs give the same bytes.
"""

import gzip
import io
import sys
from pathlib import Path

from fontTools import subset

FONTS = Path(__file__).parents[1] / "render/src/geometry/text/fonts"

STYLES = {
    "": "regular",
    "-bold": "bold",
    "-italic": "italic",
    "-bold-italic": "bolditalic",
}
GYRE = {"serif": "termes", "sans": "heros", "mono": "cursor"}
DEJAVU = {
    "serif": "DejaVuSerif",
    "serif-bold": "DejaVuSerif-Bold",
    "sans-bold": "DejaVuSans-Bold",
    "mono": "DejaVuSansMono",
}


def characters(*ranges):
    """Returns the code points of inclusive ranges."""
    return [c for first, last in ranges for c in range(first, last + 1)]


# Vietnamese is in `any-other` alone: in all twelve it would take 30 kB.
LATIN = characters(
    (0x100, 0x24F),  # Latin Extended-A and -B
    (0x2B0, 0x36F),  # modifiers, combining accents
    (0x1E00, 0x1E9F),  # Latin Extended Additional
    (0x2010, 0x2044),  # dashes, quotes, dots
    (0x20A0, 0x20BF),  # currencies
    (0xFB01, 0xFB02),  # ligatures
) + [ord(c) for c in "№™∂∑−√∞≈≠≤≥◊"]

GREEK_AND_CYRILLIC = characters((0x370, 0x3FF), (0x400, 0x45F), (0x490, 0x491))

OTHER = characters(
    (0x100, 0x36F),  # Latin Extended, phonetic letters, modifiers, combining accents
    (0x370, 0x5FF),  # Greek, Cyrillic, Armenian, Hebrew
    (0x600, 0x6FF),  # Arabic
    (0x10A0, 0x10FF),  # Georgian
    (0x1E00, 0x1FFF),  # Latin Extended Additional, Greek with accents
    (0x2000, 0x20CF),  # punctuation, superscripts, currencies
    (0x20D0, 0x20DF),  # combining arrows
    (0x2100, 0x23FF),  # letter-like symbols, fractions, arrows, mathematics, technical symbols
    (0x2460, 0x24FF),  # enclosed characters
    (0x2500, 0x25FF),  # boxes, shapes
    (0xFB00, 0xFB4F),  # ligatures, Hebrew letters with points
    (0xFB50, 0xFDFF),  # Arabic letters in their joined forms
    (0xFE70, 0xFEFC),
) + [ord(c) for c in "☀☁☂★☆☎☐☑☒☞☠☢☣☮☯☹☺♀♂♠♡♢♣♤♥♦♧♩♪♫♬♭♮♯⚠⚡✂✈✉✓✔✕✖✗✘✚✦✧✶❄❤➔➜➡"]


def write(source, unicodes, hinting, name):
    """Writes the part of a font that has some characters."""
    options = subset.Options()
    options.hinting = hinting
    options.layout_features = []
    options.glyph_names = False
    options.name_IDs = []
    options.recalc_timestamp = False
    options.drop_tables += ["GSUB", "GPOS", "GDEF", "kern", "FFTM", "DSIG", "MATH", "gasp"]
    font = subset.load_font(source, options)
    subsetter = subset.Subsetter(options)
    subsetter.populate(unicodes=unicodes)
    subsetter.subset(font)
    family = f"ivcam {name.split('.')[0]}"
    for number, text in [(1, family), (2, "Regular"), (4, family), (6, family.replace(" ", "-"))]:
        font["name"].setName(text, number, 3, 1, 0x409)
    if "CFF " in font:
        rename(font["CFF "].cff, family)
    plain = io.BytesIO()
    font.save(plain, reorderTables=True)
    packed = gzip.compress(plain.getvalue(), 9, mtime=0)
    (FONTS / f"{name}.gz").write_bytes(packed)
    print(f"{name}.gz", len(packed), "bytes,", len(font.getBestCmap()), "characters")


def rename(cff, family):
    """Replaces the names inside PostScript outlines."""
    cff.fontNames = [family.replace(" ", "-")]
    top = cff[0]
    for key in ["FullName", "FamilyName", "Notice", "Copyright", "Weight"]:
        top.rawDict.pop(key, None)
        if hasattr(top, key):
            delattr(top, key)


def main(gyre, dejavu):
    for family, design in GYRE.items():
        for style, weight in STYLES.items():
            source = f"{gyre}/texgyre{design}-{weight}.otf"
            write(source, LATIN, True, f"{family}{style}-latin.otf")
    for style, design in DEJAVU.items():
        write(f"{dejavu}/{design}.ttf", GREEK_AND_CYRILLIC, False, f"{style}-other.ttf")
    write(f"{dejavu}/DejaVuSans.ttf", OTHER, False, "any-other.ttf")


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    main(sys.argv[1], sys.argv[2])
