"""Prints the license texts of the crates that the program is built from, each text once.

Usage: notices.py FEATURES. The texts are those of the crates' packages, as cargo has downloaded them. Of a crate
without one, the name and the license are printed.
"""

import json
import pathlib
import subprocess
import sys

NAMES = ("license", "licence", "copying", "notice", "unlicense", "copyright", "ofl", "ufl")


def packages(features):
    """Returns the packages of the program from other sources, sorted by name."""
    tree = ["cargo", "tree", "--locked", "-p", "ivcam", "-e", "normal,no-proc-macro", "--prefix", "none"]
    lines = subprocess.run(tree + ["--features", features], check=True, capture_output=True, text=True).stdout
    used = {tuple(line.split()[:2]) for line in lines.splitlines()}
    metadata = ["cargo", "metadata", "--locked", "--format-version", "1", "--all-features"]
    known = json.loads(subprocess.run(metadata, check=True, capture_output=True, text=True).stdout)["packages"]
    found = [p for p in known if p["source"] and (p["name"], "v" + p["version"]) in used]
    return sorted(found, key=lambda p: (p["name"], p["version"]))


def texts(package):
    """Returns the license texts in the folder of a package."""
    folder = pathlib.Path(package["manifest_path"]).parent
    files = [f for f in folder.rglob("*") if f.is_file() and f.name.lower().startswith(NAMES) and f.suffix != ".rs"]
    return [f.read_text(errors="replace").strip() for f in sorted(files)]


def main():
    owners, texts_of, bare = {}, {}, []
    for package in packages(sys.argv[1]):
        name = f"{package['name']} {package['version']}"
        found = texts(package)
        for text in found:
            texts_of.setdefault(" ".join(text.split()), text)
            owners.setdefault(" ".join(text.split()), []).append(name)
        if not found:
            bare.append(f"{name} ({package['license']})")
    for words, names in owners.items():
        print(f"\n{'-' * 80}\n{', '.join(names)}:\n\n{texts_of[words]}")
    if bare:
        print(f"\n{'-' * 80}\nCrates whose packages have no text of their license: {', '.join(bare)}")


main()
