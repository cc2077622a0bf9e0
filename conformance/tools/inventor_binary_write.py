#!/usr/bin/env python3
"""Writes Inventor's binary files from their ASCII twins, as docs/formats/inventor-binary.md describes the format.

    python3 inventor_binary_write.py TWIN.iv OUTPUT.iv [--version 2.1]
    python3 inventor_binary_write.py --all             # makes all files of conformance/inventor-binary again

`--all` follows inventor-binary/twins.json: for each file its twin, its version, and what is done to its bytes: `gzip`,
`cut N` (the last N bytes are missing), `default` (each field is flagged as default), `wide name` (more blanks in the
header). It takes the ASCII of the suite's own files, not all that Inventor allows. Needs Python 3.9 and nothing else.
"""

import argparse
import gzip
import json
import pathlib
import re
import struct

from inventor_binary import NUMBERS, OLD_NAMES, Catalogue

HERE = pathlib.Path(__file__).resolve().parent
SUITE = HERE.parent
TOKEN = re.compile(r'"((?:[^"\\]|\\.)*)"|#[^\n]*|[\s,]+|([{}\[\]()|=~.](?![\d])|[^\s,{}\[\]"#()|=~]+)', re.S)
BARE = {(1, 0): ("Group", "Separator", "TransformSeparator"), (2, 0): ("Group", "TransformSeparator")}
TYPED = {"Gate": ["input"], "SelectOne": ["input"], "Concatenate": [f"input{i}" for i in range(10)]}


def tokens(text):
    """Returns the words, marks and strings of a text; a string begins with a quote."""
    found = []
    for match in TOKEN.finditer(text):
        string, word = match.groups()
        if string is not None:
            found.append('"' + string.replace('\\"', '"'))
        elif word:
            found += word.split(".") if re.match(r"[A-Za-z_]\w*\.[A-Za-z_]\w*$", word) else [word]
    return found


class Writer:
    """Turns the tokens of a twin into bytes, one node after the other."""

    def __init__(self, text, version, flags):
        header, _, body = text.partition("\n")
        self.tokens, self.at = tokens(body), 0
        self.version, self.flags = version, flags
        self.catalogue, self.declared = Catalogue(), {}

    def write(self, header):
        out = header + b" " * (-len(header + b"\n") % 4) + b"\n"
        while self.at < len(self.tokens):
            out += self.node()
        return out

    def next(self):
        self.at += 1
        return self.tokens[self.at - 1]

    def takes(self, word):
        """Returns whether the next token is this one, and goes past it."""
        if self.at < len(self.tokens) and self.tokens[self.at] == word:
            self.at += 1
            return True
        return False

    def node(self):
        if self.takes("NULL"):
            return string("NULL")
        if self.takes("USE"):
            return string("USE") + string(self.next())
        out = b""
        if self.takes("DEF"):
            out = string("DEF") + string(self.next())
        name = self.next()
        name = name[2:] if name.startswith("So") else name
        self.next()
        return out + string(name) + self.body(name)

    def body(self, name):
        described, types = self.description(name)
        fields, children, first = [], [], b""
        while not self.takes("}"):
            word = self.tokens[self.at]
            if name in TYPED and word == "type":
                self.next()
                kind = self.next().lstrip('"')
                first = string("type") + string(kind) + word_of(0)
                types.update(dict.fromkeys(TYPED[name], kind))
            elif word in types:
                fields.append(self.field(types))
            else:
                children.append(self.node())
        group = self.catalogue.is_group(name) or bool(children)
        flags = 2 if group else int(self.catalogue.is_a(name, "Engine"))
        out = word_of(flags) if self.version >= (2, 1) else b""
        bare = name in BARE.get(self.version, ())
        count = b"" if bare else word_of(len(fields) | (0x4000 if described else 0))
        out += first + count + described + b"".join(fields)
        end = struct.pack(">i", -1) if self.version < (2, 0) else b""
        return out + (word_of(len(children)) + b"".join(children) + end if group else b"")

    def description(self, name):
        """Reads `fields [ ]`. Returns its bytes, and the types of the class's fields."""
        if not self.takes("fields"):
            return self.declared.get(name, (b"", dict(self.catalogue.fields(name))))
        types = {}
        self.next()
        while not self.takes("]"):
            kind, field = self.next(), self.next()
            types[field] = kind
        self.declared[name] = b"".join(string(k) + string(f) for f, k in types.items()), types
        return self.declared[name]

    def field(self, types):
        name = self.next()
        flags, kind = self.flags, types[name]
        ends = self.tokens[self.at] in ("~", "=")
        out = string(name) + (default(kind) if ends else self.value(kind))
        flags |= 1 if self.takes("~") else 0
        if not self.takes("="):
            return out + word_of(flags)
        source = self.node()
        self.takes(".")
        return out + word_of(flags | 2) + source + string(self.next())

    def value(self, kind):
        many, base = kind.startswith("MF"), OLD_NAMES.get(kind[2:], kind[2:])
        if many:
            values = []
            if self.takes("["):
                while not self.takes("]"):
                    values.append(self.value("SF" + base))
            else:
                values.append(self.value("SF" + base))
            return word_of(len(values)) + b"".join(values)
        if base in NUMBERS:
            code, width = NUMBERS[base]
            return b"".join(struct.pack(">" + code, number(self.next(), code)) for _ in range(width))
        if base in ("Node", "Path"):
            return self.node()
        if base == "BitMask":
            flags = [self.next()]
            if flags == ["("]:
                flags = [word for word in iter(self.next, ")") if word != "|"]
            return b"".join(map(string, flags)) + word_of(0)
        if base == "Image":
            return self.image()
        return string(self.next().lstrip('"'))

    def image(self):
        width, height, components = (int(self.next(), 0) for _ in range(3))
        pixels = [int(self.next(), 0) for _ in range(width * height)]
        head = struct.pack(">III", width, height, components)
        if self.version < (2, 1):
            return head + struct.pack(f">{len(pixels)}I", *pixels)
        return head + b"".join(p.to_bytes(components, "big") for p in pixels)


def padded(data):
    return data + bytes(-len(data) % 4)


def word_of(number):
    return struct.pack(">I", number)


def string(text):
    return word_of(len(text.encode())) + padded(text.encode())


def default(kind):
    """Returns the bytes of a value that a twin leaves out: zeros, or no values."""
    if kind.startswith("MF"):
        return word_of(0)
    code, width = NUMBERS[OLD_NAMES.get(kind[2:], kind[2:])]
    return struct.pack(f">{width}{code}", *[0] * width)


def number(word, code):
    if word in ("TRUE", "FALSE"):
        return int(word == "TRUE")
    return float(word) if code in "fd" else int(word, 8 if re.match(r"0[0-7]+$", word) else 0)


def made(entry):
    """Returns the bytes of a file of twins.json."""
    version = tuple(int(part) for part in entry["version"].split("."))
    how = entry.get("bytes", "")
    header = f"#Inventor V{entry['version']} binary".encode() + (b"   " if how == "wide name" else b"")
    text = (SUITE / entry["twin"]).read_text(encoding="utf-8")
    data = Writer(text, version, 4 if how == "default" else 0).write(header)
    if how == "gzip":
        return gzip.compress(data, 9, mtime=0)
    return data[:-int(how[4:])] if how.startswith("cut ") else data


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("twin", nargs="?", type=pathlib.Path)
    parser.add_argument("output", nargs="?", type=pathlib.Path)
    parser.add_argument("--version", default="2.1")
    parser.add_argument("--all", action="store_true")
    options = parser.parse_args()
    if options.all:
        folder = SUITE / "inventor-binary"
        for name, entry in json.loads((folder / "twins.json").read_text()).items():
            (folder / name).parent.mkdir(exist_ok=True)
            (folder / name).write_bytes(made(entry))
    elif options.output:
        options.output.write_bytes(made({"twin": options.twin.resolve(), "version": options.version}))
    else:
        parser.error("name a twin and an output, or --all")


if __name__ == "__main__":
    main()
