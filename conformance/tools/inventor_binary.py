#!/usr/bin/env python3
"""Reads Inventor's binary files, as docs/formats/inventor-binary.md describes them.

    python3 inventor_binary.py FILE                            # the tree, as JSON
    python3 inventor_binary.py --check FOLDER --ivcam PROGRAM  # compares all binary files below a folder with ivcam

Classes and the types of their fields come from grammar/*.nodes. Needs Python 3.9 and nothing else.
"""

import argparse
import gzip
import json
import math
import pathlib
import re
import struct
import subprocess
import sys

HERE = pathlib.Path(__file__).resolve().parent
GRAMMAR = HERE.parent.parent / "grammar"
NUMBERS = {"Bool": ("I", 1), "Int32": ("i", 1), "Short": ("i", 1), "UInt32": ("I", 1), "UShort": ("I", 1),
           "Float": ("f", 1), "Double": ("d", 1), "Time": ("d", 1), "Vec2f": ("f", 2), "Vec3f": ("f", 3),
           "Vec4f": ("f", 4), "Color": ("f", 3), "Vec3d": ("d", 3), "Rotation": ("f", 4), "Plane": ("f", 4),
           "Matrix": ("f", 16), "Vec2s": ("i", 2), "Vec2i32": ("i", 2), "Vec3i32": ("i", 3), "Vec4i32": ("i", 4)}
OLD_NAMES = {"Long": "Int32", "ULong": "UInt32"}
OLD_FIELDS = {"PackedColor": {"rgba": "MFUInt32"}, "ShapeHints": {"hints": "SFBitMask"},
              "Environment": {"fogDensity": "SFFloat", "fogComputed": "SFEnum"},
              "LightModel": {"nearColor": "SFColor", "farColor": "SFColor"},
              "Texture2": {"minFilter": "SFEnum", "magFilter": "SFEnum", "component": "SFEnum"},
              "TextureCoordinatePlane": {"coord": "SFEnum", "normal": "SFVec3f", "distanceFromOrigin": "SFFloat",
                                         "repeatInterval": "SFFloat"}}


class Damaged(Exception):
    """The file cannot be read on from here."""


class Catalogue:
    """The classes of grammar/*.nodes with the types of their fields."""

    def __init__(self, folder=GRAMMAR):
        self.family, self.own = {}, {}
        for file in sorted(folder.glob("*.nodes")):
            if file.stem not in ("vrml97", "x3d"):
                self.read(file.read_text(encoding="utf-8").splitlines())

    def read(self, lines):
        name = None
        for line in lines:
            words = line.split("#")[0].split()
            if not words:
                continue
            if not line[0].isspace():
                name, family = words[0], words[2]
                if " vrml1 " in f" {line} " and name in self.own and not re.search(r"\biv[12]\b", line):
                    continue
                self.family[name], self.own[name] = family, {}
            elif words[0] in ("part", "list"):
                self.own[name][words[1]] = "SFNode"
            elif words[0] not in ("out", "in", "x3d") and re.match(r"[SM]F", words[0]):
                self.own[name][words[1]] = words[0]

    def known(self, name):
        return name in self.family

    def fields(self, name):
        """Returns the types of all fields of a class, by their names."""
        found = dict(OLD_FIELDS.get(name, {}))
        while name in self.family:
            found = {**self.own[name], **found}
            name = self.family[name]
        return found

    def is_a(self, name, family):
        while name in self.family and name != family:
            name = self.family[name]
        return name == family

    def is_group(self, name):
        return self.is_a(name, "Group")


class Reader:
    """Reads the nodes of one file. `roots` has those at the top."""

    def __init__(self, data, catalogue):
        if data[:2] == b"\x1f\x8b":
            data = gzip.decompress(data)
        line, _, self.data = data.partition(b"\n")
        header = re.match(rb"#Inventor V(\d)\.(\d) binary", line)
        if not header:
            raise Damaged("no header of a binary file")
        self.version = (int(header[1]), int(header[2]))
        self.catalogue, self.declared, self.at = catalogue, {}, 0
        self.roots = []

    def read(self):
        while any(self.data[self.at:self.at + 64]) or any(self.data[self.at:]):
            self.roots.append(self.node())
        return self.roots

    # Words

    def numbers(self, code, count):
        size = struct.calcsize(">" + code) * count
        if self.at + size > len(self.data):
            raise Damaged(f"{count} values at byte {self.at}, beyond the end")
        found = list(struct.unpack_from(f">{count}{code}", self.data, self.at))
        self.at += size
        return found

    def word(self):
        return self.numbers("I", 1)[0]

    def bytes(self, count):
        if self.at + count > len(self.data):
            raise Damaged(f"{count} bytes at byte {self.at}, beyond the end")
        found = self.data[self.at:self.at + count]
        self.at += (count + 3) // 4 * 4
        return found

    def string(self):
        return self.bytes(self.word()).decode("utf-8", "replace")

    # Nodes

    def node(self):
        """Reads a node, USE or NULL (None)."""
        start, name, word = self.at, "", self.string()
        if word == "NULL":
            return None
        if word == "USE":
            return {"use": self.string()}
        if word == "DEF":
            name, word = self.string(), self.string()
        if not re.match(r"[A-Za-z_]\w*$", word):
            raise Damaged(f"no class at byte {start}: {word[:20]!r}")
        made = {"class": word, "name": name, "fields": {}, "children": []}
        if word == "Path":
            made["fields"]["head"] = [self.node()]
            made["fields"]["indices"] = self.numbers("i", self.word())
            return made
        flags = self.word() if self.version >= (2, 1) else 2 * self.is_group(word)
        types = self.types_first(made)
        count = 0 if self.lacks_count(word) else self.word()
        if word == "GlobalField":
            count = max(count, 1)  # SGI's library writes 0, Coin 1.
        if flags & ~3 or count & ~0x7fff:
            raise Damaged(f"{word} with flags {flags} and {count} fields at byte {self.at}")
        if count & 0x4000 and self.version >= (2, 1):
            count &= 0x3fff
            types = dict(reversed((self.string(), self.string())) for _ in range(count))
            self.declared[word] = types
        elif word in self.declared:
            types = self.declared[word]
        elif not self.catalogue.known(word) and word != "LayerGroup" and (count or self.version < (2, 1)):
            raise Damaged(f"the class {word} is not known, at byte {start}")
        for _ in range(count):
            self.field(made, types)
        if flags & 2:
            made["children"] = [self.node() for _ in range(self.word())]
            if self.version < (2, 0) and self.numbers("i", 1) != [-1]:
                raise Damaged(f"no end of the children at byte {self.at}")
        return made

    def is_group(self, name):
        return self.catalogue.is_group(name) or name == "LayerGroup"

    def lacks_count(self, name):
        """Returns whether the number of fields is missing, as it is in groups without fields before 2.1."""
        bare = ("Group", "TransformSeparator")
        if self.version < (2, 0):
            bare += ("Separator", "LayerGroup")
        return self.version < (2, 1) and name in bare

    def types_first(self, made):
        """Returns the types of a class's fields. Reads the type of classes whose fields depend on it."""
        name = made["class"]
        types = self.catalogue.fields(name)
        if name in ("GlobalField", "Gate", "SelectOne", "Concatenate"):
            if self.string() != "type":
                raise Damaged(f"{name} without a type at byte {self.at}")
            kind = self.string()
            made["fields"]["type"] = [kind]
            kind = kind[2:] if kind.startswith("So") else kind
            if name == "GlobalField":
                return {**types, None: kind}
            self.word()
            inputs = ["input"] if name != "Concatenate" else [f"input{i}" for i in range(10)]
            types.update(dict.fromkeys(inputs, "MF" + kind[2:]))
        return types

    def field(self, made, types):
        start, name = self.at, self.string()
        kind = types.get(name, types.get(None))
        if kind is None:
            raise Damaged(f"{made['class']} has no field {name[:40]!r}, at byte {start}")
        values = self.value(kind)
        flags = self.word()
        if flags & ~7:
            raise Damaged(f"flags {flags:#x} of {name} at byte {self.at}")
        if flags & 1:
            values.append("~")
        if flags & 2:
            values += ["=", self.node()]
            self.string()
        made["fields"][name] = values

    # Values

    def value(self, kind):
        """Reads a value, and returns a list of numbers, strings or nodes."""
        many, kind = kind.startswith("MF"), OLD_NAMES.get(kind[2:], kind[2:])
        if kind in NUMBERS:
            code, width = NUMBERS[kind]
            found = self.numbers(code, width * (self.word() if many else 1))
            return [bool(n) for n in found] if kind == "Bool" else found
        if many:
            one = "SF" + kind
            return [value for _ in range(self.word()) for value in self.value(one)]
        if kind in ("String", "Name", "Enum"):
            return [self.string()]
        if kind == "BitMask":
            return list(iter(self.string, ""))
        if kind in ("Node", "Path", "Engine"):
            return [self.node()]
        if kind == "Image":
            return self.image()
        if kind == "Trigger":
            return []
        raise Damaged(f"the type {kind} is not known, at byte {self.at}")

    def pixels(self, count):
        """Returns the bytes of an image, which Coin pads to a multiple of four and SGI's library does not."""
        bare = self.at + count
        data = self.bytes(count)
        if self.continues(bare) or not self.continues(self.at):
            self.at = bare
        return data

    def continues(self, at):
        """Returns whether flags and counts, and then a name or the end of the file are at a place."""
        for at in range(at, min(len(self.data), at + 1024), 4):
            number, rest = int.from_bytes(self.data[at:at + 4], "big"), self.data[at + 4:at + 260]
            if re.match(rb"[A-Za-z_]\w*$", rest[:number]) and number <= len(rest):
                return True
            if at + 4 > len(self.data) or number > (len(self.data) - at - 4) // 4:
                return False
        return at + 4 >= len(self.data)

    def image(self):
        width, height, components = self.numbers("I", 3)
        if components > 4:
            raise Damaged(f"an image of {components} components at byte {self.at}")
        pixels = width * height
        if self.version < (2, 1):
            words = self.numbers("I", pixels if components else 0)
            return [width, height, components] + [w & (256 ** components - 1) for w in words]
        data = self.pixels(pixels * components)
        steps = range(0, len(data), components or 1)
        return [width, height, components] + [int.from_bytes(data[i:i + components], "big") for i in steps]


# Comparison with ivcam

def same(a, b):
    """Returns whether two values are equal. DEFAULT is a binding's old name of another value."""
    if a == "DEFAULT" and isinstance(b, str):
        return True
    if isinstance(a, dict) or isinstance(b, dict) or isinstance(a, str) or isinstance(b, str):
        return a == b
    return a == b or math.isclose(a, b, rel_tol=1e-6, abs_tol=1e-30) or (a != a and b != b)


def plain(name):
    return re.sub(r"\+\d+$", "", name)


def differences(ours, theirs, path, tally):
    """Yields what differs between two lists of nodes. Counts nodes, fields and values in `tally`."""
    if len(ours) != len(theirs):
        yield f"{path}: {len(ours)} and {len(theirs)} nodes"
        return
    for index, (a, b) in enumerate(zip(ours, theirs)):
        if a is None or "use" in a or "use" in b:
            if a is not None and plain(a.get("use", "")) != b.get("use"):
                yield f"{path}[{index}]: USE {a.get('use')} and {b.get('use')}"
            continue
        here = f"{path}/{a['class']}[{index}]"
        tally["nodes"] += 1
        if a["class"] != b["class"] or plain(a["name"]) not in ("", b["name"]):
            yield f"{here}: {a['class']} {a['name']} and {b['class']} {b['name']}"
            continue
        for name in a["fields"].keys() & b["fields"].keys():
            yield from field_differences(a["fields"][name], b["fields"][name], f"{here}.{name}", tally)
        alone = a["fields"].keys() - b["fields"].keys()
        renamed = alone & OLD_FIELDS.get(a["class"], {}).keys()
        tally["fields of older versions"] += len(renamed)
        tally["fields that ivcam leaves out"] += len(alone - renamed)
        yield from differences(a["children"], b["children"], here, tally)


def field_differences(a, b, path, tally):
    tally["fields"] += 1
    tally["values"] += len(a)
    nodes = [v for v in a if isinstance(v, dict)], [v for v in b if isinstance(v, dict)]
    yield from differences(*nodes, path, tally)
    a, b = ([v for v in values if not isinstance(v, dict)] for values in (a, b))
    a = [int(v) if isinstance(v, bool) else v for v in a if v is not None]
    b = [int(v) if isinstance(v, bool) else v for v in b if v != "NULL"]
    if len(a) != len(b) or not all(map(same, a, b)):
        yield f"{path}: {a[:8]} and {b[:8]} of {len(a)} and {len(b)}"


def is_binary(path):
    data = path.read_bytes()[:1 << 20]
    if data[:2] == b"\x1f\x8b":
        data = gzip.open(path).read(64)
    return re.match(rb"#Inventor V\d\.\d binary", data) is not None


def check(folder, program):
    """Compares each binary file below a folder, and returns the number of files that differ."""
    sys.path.insert(0, str(HERE.parent))
    from scene_text import roots
    catalogue, bad, files = Catalogue(), 0, 0
    tally = {"nodes": 0, "fields": 0, "values": 0, "fields of older versions": 0, "fields that ivcam leaves out": 0}
    for path in sorted(p for p in folder.rglob("*") if p.is_file() and is_binary(p)):
        files += 1
        converted = subprocess.run([program, "convert", path, "--to", "ascii"], capture_output=True, text=True,
                                   errors="replace")
        try:
            found = list(differences(Reader(path.read_bytes(), catalogue).read(), roots(converted.stdout), "", tally))
        except Damaged as damage:
            found = [str(damage)]
        bad += bool(found)
        for line in found[:5]:
            print(f"{path.relative_to(folder)}: {line}")
    print(f"{files} files, {bad} of them differ; " + ", ".join(f"{n} {what}" for what, n in tally.items()))
    return bad


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("file", nargs="?", type=pathlib.Path)
    parser.add_argument("--check", type=pathlib.Path, metavar="FOLDER")
    parser.add_argument("--ivcam", default="ivcam", metavar="PROGRAM")
    options = parser.parse_args()
    if options.check:
        return int(check(options.check, options.ivcam) > 0)
    if not options.file:
        parser.error("name a file, or a folder after --check")
    try:
        print(json.dumps(Reader(options.file.read_bytes(), Catalogue()).read(), indent=1))
    except Damaged as damage:
        sys.exit(f"{options.file}: {damage}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
