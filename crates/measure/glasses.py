"""Rows for lenses/glasses.txt from the database of refractiveindex.info, which is in the public domain.

    python crates/measure/glasses.py DATABASE/data-nk lenses/glasses.txt > rows.txt

Prints a row for each glass of the makers that the table does not have. The formulas are those of the
head of the table. A glass of which the database has only tabulated indices, or a formula that the
table has not, gets its indices at F, d and C; one for the infrared gets Schott's formula with four to six
coefficients, if that meets its indices within 5e-4. Needs NumPy.
"""

import re
import sys
from pathlib import Path
from typing import Iterator, List, Optional

import numpy as np

MAKERS = ["schott", "ohara", "hoya", "hikari", "sumita", "cdgm", "lzos", "vitron", "ami", "lightpath"]

#: Crystals and plastics: the name in lens files, and the file of the database.
OTHERS = {
    "GERMANIUM": "main/Ge/Burnett.yml",
    "SILICON": "main/Si/Salzberg.yml",
    "ZNSE": "main/ZnSe/Connolly.yml",
    "ZNS": "main/ZnS/Debenham.yml",
    "GAAS": "main/GaAs/Skauli.yml",
    "BAF2": "main/BaF2/Malitson.yml",
    "LIF": "main/LiF/Li.yml",
    "MGF2": "main/MgF2/Dodge-o.yml",
    "SAPPHIRE": "main/Al2O3/Malitson-o.yml",
    "SRF2": "main/SrF2/Li.yml",
    "KCL": "main/KCl/Li.yml",
    "PMMA": "organic/(C5H8O2)n - poly(methyl methacrylate)/Sultanova.yml",
    "POLYCARB": "organic/(C16H14O3)n - polycarbonate/Sultanova.yml",
    "POLYSTYR": "organic/(C8H8)n - polystyren/Sultanova.yml",
    "E48R": "other/commercial plastics/ZeonexE48R/Sultanova.yml",
    "NAS-21": "other/commercial plastics/NAS-21/Sultanova.yml",
    "OPTOREZ1330": "other/commercial plastics/Optorez1330/Sultanova.yml",
    "WATER": "main/H2O/Daimon-20.0C.yml",
}

F, D, C = 0.4861327, 0.5875618, 0.6562725
SCHOTT = [0, 2, -2, -4, -6, -8]
EXTENDED3 = [0, 2, 4, -2, -4, -6, -8, -10, -12]


def key(name: str) -> str:
    return re.sub("[^A-Z0-9]", "", name.upper())


def index(kind: int, c: List[float], um: float) -> float:
    pairs = list(zip(c[1::2], c[2::2]))
    if kind == 1:
        return (1 + c[0] + sum(b * um**2 / (um**2 - l**2) for b, l in pairs)) ** 0.5
    if kind == 2:
        return (1 + c[0] + sum(b * um**2 / (um**2 - l) for b, l in pairs)) ** 0.5
    powers = c[0] + sum(b * um**p for b, p in pairs)
    return powers**0.5 if kind == 3 else powers


def lines(at: List[float]) -> str:
    return "lines      " + " ".join(f"{n:.6f}" for n in at)


def formula(text: str) -> Optional[str]:
    """Returns the formula and its coefficients as the table has them."""
    found = re.search(r"type: formula ([1-9]) *\n(?:.*\n)?? *coefficients: ([^\n]*)", text)
    if not found:
        return tabulated(text)
    kind, words = int(found[1]), found[2].split()
    c = [float(word) for word in words]
    powers = [float(p) for p in words[2::2]]
    if kind in (1, 2):
        squares = [l if kind == 2 else f"{float(l) ** 2:.9g}" for l in words[2::2]]
        terms = [word for pair in zip(words[1::2], squares) for word in pair]
        if c[0]:
            terms += [words[0], "0"]
        names = {6: "sellmeier", 8: "sellmeier3", 10: "sellmeier5"}
        while len(terms) < 6:
            terms += ["0", "0"]
        if len(terms) in names:
            return f"{names[len(terms)]:<10} " + " ".join(terms)
    if kind == 3:
        by_power = {0.0: words[0], **dict(zip(powers, words[1::2]))}
        for name, own in (("schott", SCHOTT), ("extended3", EXTENDED3)):
            if set(by_power) <= set(map(float, own)):
                return f"{name:<10} " + " ".join(by_power.get(float(p), "0") for p in own)
    if kind in (3, 5):
        return lines([index(kind, c, um) for um in (F, D, C)])
    return None


def tabulated(text: str) -> Optional[str]:
    """Returns the indices at F, d and C by linear interpolation of a table."""
    found = re.search(r"type: tabulated nk?\n *data: \|\n((?: +[-0-9.eE+ ]+\n)+)", text)
    rows = [[float(w) for w in line.split()[:2]] for line in found[1].splitlines()] if found else []
    if rows and rows[0][0] > C:
        return infrared(np.array(rows))
    if not rows or rows[0][0] > F or rows[-1][0] < C:
        return None

    def at(um: float) -> float:
        (a, n), (b, m) = next(pair for pair in zip(rows, rows[1:]) if pair[1][0] >= um)
        return n + (m - n) * (um - a) / (b - a)

    return lines([at(um) for um in (F, D, C)])


def infrared(rows: np.ndarray) -> Optional[str]:
    """Returns Schott's formula through the indices of a table beyond the visible."""
    um, n = rows.T
    for count in (4, 5, 6):
        terms = um[:, None] ** np.array(SCHOTT[:count])
        c = np.linalg.lstsq(terms, n**2, rcond=None)[0]
        if len(rows) > 2 * count and np.abs(np.sqrt(terms @ c) - n).max() < 5e-4:
            return "schott     " + " ".join(f"{x:.9g}" for x in c)
    return None


def files(root: Path) -> Iterator[tuple]:
    # In lens files BAF2 is the crystal, not the glass of CDGM.
    for name, file in OTHERS.items():
        yield "other", name, root / file
    for maker in MAKERS:
        for path in sorted((root / "glass" / maker).rglob("*.yml")):
            yield maker, path.stem, path


def main() -> None:
    root, table = map(Path, sys.argv[1:])
    rows = (line.split() for line in table.read_text().splitlines() if not line.startswith("#"))
    known = {key(row[1]) for row in rows if len(row) > 2}
    for maker, name, path in files(root):
        if not path.exists():
            print(f"{name}: {path} is not there", file=sys.stderr)
        elif key(name) not in known:
            found = formula(path.read_text())
            if found:
                known.add(key(name))
                print(f"{maker:<9} {name:<14} {found}")
            else:
                print(f"{maker} {name}: no formula of the table", file=sys.stderr)


if __name__ == "__main__":
    main()
