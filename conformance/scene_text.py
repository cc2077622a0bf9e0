"""Reads the text that a library or program writes for a scene into a tree, without knowing any node class.

This is no reader of arbitrary files: it takes text as writers make it, where each field of a node begins with its
name. Lines matter only for values without brackets: such a value ends with its line, or with the numbers after it.

A node is {"class", "name", "fields", "children"}; a field is a list of its values: numbers, true, false, words,
strings, nodes, and "~" where the field is ignored. A `USE` is {"use": name}. The children of VRML97's `children`
are children like those of Inventor's groups.
"""

import re

TOKEN = re.compile(r'"((?:[^"\\]|\\.)*)"|#[^\n]*|(\n)|[ \t\r\f\v,()|]+|([{}\[\]])|((?:[^\s,{}\[\]"#()|])+)', re.S)
NUMBER = re.compile(r"[-+]?(0[xX][0-9a-fA-F]+|\d+\.?\d*([eE][-+]?\d+)?|\.\d+([eE][-+]?\d+)?)$")


def tokens(text):
    """Returns (kind, value) pairs; the kinds are string, line, mark and word."""
    found = []
    for match in TOKEN.finditer(text):
        string, line, mark, word = match.groups()
        if string is not None:
            found.append(("string", re.sub(r'\\(["\\])', r"\1", string)))
        elif line:
            found.append(("line", "\n"))
        elif mark:
            found.append(("mark", mark))
        elif word:
            found.append(("word", word))
    return found


def value(kind, word):
    """Returns a number, a truth value, or the word itself."""
    if kind == "string":
        return word
    if word in ("TRUE", "FALSE"):
        return word == "TRUE"
    if NUMBER.match(word):
        return int(word, 16) if "x" in word.lower() else float(word)
    return word


def plain_name(name):
    """Returns a DEF name without the number that a writer adds to keep names apart."""
    return re.sub(r"\+\d+$", "", name)


class Tree:
    def __init__(self, text):
        self.tokens = tokens(text)
        self.at = 0

    def skip_lines(self):
        while self.at < len(self.tokens) and self.tokens[self.at][0] == "line":
            self.at += 1

    def peek(self, ahead=0):
        """Returns the token after `ahead` more tokens that are not line ends."""
        at = self.at
        while at < len(self.tokens):
            if self.tokens[at][0] != "line":
                if ahead == 0:
                    return self.tokens[at]
                ahead -= 1
            at += 1
        return ("end", "")

    def next(self):
        self.skip_lines()
        token = self.tokens[self.at]
        self.at += 1
        return token

    def starts_node(self):
        kind, word = self.peek()
        if kind != "word":
            return False
        return word in ("DEF", "USE") or self.peek(1) == ("mark", "{")

    def node(self):
        word = self.next()[1]
        if word == "USE":
            return {"use": plain_name(self.next()[1])}
        name = ""
        if word == "DEF":
            name = plain_name(self.next()[1])
            word = self.next()[1]
        self.next()
        made = {"class": word, "name": name, "fields": {}, "children": []}
        while self.peek() not in (("mark", "}"), ("end", "")):
            if self.starts_node():
                made["children"].append(self.node())
            elif self.peek()[1] in ("ROUTE", "PROTO", "EXTERNPROTO"):
                self.statement()
            else:
                self.field(made)
        if self.peek()[0] != "end":
            self.next()
        return made

    def statement(self):
        """Skips a ROUTE, and the brackets of a prototype."""
        word = self.next()[1]
        if word == "ROUTE":
            self.next(), self.next(), self.next()
            return
        self.next()
        self.brackets()
        if word == "PROTO":
            self.brackets()
        elif self.peek() == ("mark", "["):
            self.brackets()
        else:
            self.next()

    def brackets(self):
        depth = 0
        while True:
            kind, word = self.next()
            depth += kind == "mark" and word in "[{"
            depth -= kind == "mark" and word in "]}"
            if depth == 0:
                return

    def field(self, made):
        name = self.next()[1]
        if name in ("fields", "isA", "inputs", "outputs") and self.peek() == ("mark", "["):
            return self.brackets()
        if name in ("field", "exposedField", "eventIn", "eventOut") and made["class"] == "Script":
            self.next()
            name = self.next()[1]
        values = self.values()
        if name == "children" and all(isinstance(v, dict) for v in values):
            made["children"] += values
        else:
            made["fields"][name] = values

    def continues(self):
        """Returns whether a value without brackets goes on: to the end of its line, and with numbers after it."""
        if self.at >= len(self.tokens) or self.tokens[self.at][0] == "mark":
            return False
        kind, word = self.peek()
        return self.tokens[self.at][0] != "line" or (kind == "word" and bool(NUMBER.match(word)))

    def values(self):
        found = []
        if self.peek() == ("mark", "["):
            self.next()
            while self.peek() not in (("mark", "]"), ("end", "")):
                found.append(self.node() if self.starts_node() else value(*self.next()))
            self.next()
        elif self.starts_node():
            found.append(self.node())
        else:
            self.skip_lines()
            while self.continues():
                found.append(value(*self.next()))
        while self.at < len(self.tokens) and self.tokens[self.at] in (("word", "~"), ("word", "=")):
            if self.next()[1] == "~":
                found.append("~")
            else:
                found += ["=", self.node()]
                self.next(), self.next()
        return found


def roots(text):
    """Returns the nodes at the top of a text."""
    tree = Tree(text)
    found = []
    while tree.peek()[0] != "end":
        if tree.starts_node():
            found.append(tree.node())
        elif tree.peek()[1] in ("ROUTE", "PROTO", "EXTERNPROTO"):
            tree.statement()
        else:
            tree.next()
    return found
