#!/usr/bin/env python3
"""Runs the conformance cases behind readers of Inventor and VRML files, and prints a table of what they answer.

    python3 conformance/run.py ivcam                     # the table of one reader
    python3 conformance/run.py ivcam coin --json out.json
    python3 conformance/run.py ivcam --only vrml97/shapes --list
    python3 conformance/run.py --table out.json           # the table of earlier answers, as Markdown

A reader is a file in `adapters/`. Needs Python 3.9 and nothing else. Exit code 1: a case failed or was refused.
"""

import argparse
import datetime
import importlib
import json
import pathlib
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))
DIALECTS = ["inventor-1.0", "inventor-2.0", "inventor-2.1", "inventor-binary", "vrml-1.0", "vrml97"]
KINDS = ["tree", "box", "triangles", "camera", "picture", "messages"]
SIZE = [100, 100]


class Refused(Exception):
    """The reader does not read the file at all, and says so."""


class Failed(Exception):
    """The reader crashes, or does not end."""


def cases(only):
    """Yields (name, path, expectation) of each case, by dialect and category."""
    for dialect in DIALECTS:
        for listing in sorted((HERE / dialect).glob("*/cases.json")):
            for file, case in json.loads(listing.read_text(encoding="utf-8")).items():
                name = f"{dialect}/{listing.parent.name}/{file}"
                if not only or any(word in name for word in only):
                    yield name, listing.parent / file, case


def near(a, b, tolerance):
    return abs(a - b) <= tolerance


def same_value(want, got):
    if isinstance(want, dict):
        return isinstance(got, dict) and tree_problem([want], [got]) is None
    if isinstance(want, bool) or isinstance(got, bool):
        return want == got or (isinstance(got, (int, float)) and want == bool(got))
    if isinstance(want, (int, float)):
        return isinstance(got, (int, float)) and near(want, got, 1e-5 * max(1, abs(want)))
    return want == got


def tree_problem(want, got, path="root"):
    """Returns what differs between the expected nodes and those of a reader, or None."""
    if len(want) != len(got):
        return f"{path}: {len(got)} nodes, not {len(want)}"
    for index, (w, g) in enumerate(zip(want, got)):
        here = f"{path}/{w.get('class', 'USE')}[{index}]"
        if "use" in w or "use" in g:
            if w.get("use") != g.get("use"):
                return f"{here}: {g.get('use', g.get('class'))}"
            continue
        if w["class"] != g["class"]:
            return f"{here}: class {g['class']}"
        if w.get("name", "") not in ("", g["name"]):
            return f"{here}: name {g['name']!r}, not {w['name']!r}"
        for field, values in w.get("fields", {}).items():
            seen = g["fields"].get(field)
            if seen is None:
                return f"{here}: no field {field}"
            if len(seen) != len(values) or not all(map(same_value, values, seen)):
                return f"{here}: {field} {seen}, not {values}"
        if "children" in w:
            problem = tree_problem(w["children"], g["children"], here)
            if problem:
                return problem
    return None


def box_problem(want, got, case):
    if want is None or got is None:
        return None if want is got else f"box {got}, not {want}"
    known = [b - a for a, b in zip(want["min"], want["max"]) if a is not None and b is not None]
    size = max(known, default=1)
    tolerance = case.get("box tolerance", 1e-4 * max(size, 1))
    for end in ("min", "max"):
        if not all(a is None or near(a, b, tolerance) for a, b in zip(want[end], got[end])):
            return f"box {end} {[round(x, 5) for x in got[end]]}, not {want[end]}"
    return None


def camera_problem(want, got):
    if got is None:
        return "no camera"
    for key, value in want.items():
        seen = got.get(key)
        if isinstance(value, list):
            right = seen is not None and all(near(a, b, 1e-4) for a, b in zip(value, seen))
        elif isinstance(value, (int, float)):
            right = isinstance(seen, (int, float)) and near(value, seen, 1e-4)
        else:
            right = seen == value
        if not right:
            return f"camera {key} {seen}, not {value}"
    return None


def pixel_problem(check, size, pixel):
    """Checks one place of a picture; `pixel` gives the bytes of a column and row from the upper left corner."""
    x, y = check["at"]
    seen = pixel(min(int(x * size[0]), size[0] - 1), min(int(y * size[1]), size[1] - 1))
    tolerance = check.get("tolerance", 0.02)
    want = check.get("color", check.get("not"))
    equal = all(near(255 * w, s, 255 * tolerance + 0.5) for w, s in zip(want, seen))
    if equal == ("color" in check):
        return None
    shown = [round(s / 255, 3) for s in seen]
    return f"color {shown} at {x} {y}, " + ("not" if "color" in check else "which is excluded:") + f" {want}"


def messages_problem(want, got):
    if want == "some":
        return None if got else "nothing is said"
    return f"says: {got[0]}" if got and want == "none" else None


def check(kind, case, answer):
    """Returns what differs from the expectation of one kind, or None."""
    want = case["expect"].get(kind)
    got = answer.get(kind)
    if kind == "tree":
        return tree_problem(want, got)
    if kind == "box":
        return box_problem(want, got, case)
    if kind == "triangles":
        return None if want == got else f"{got} triangles, not {want}"
    if kind == "camera":
        return camera_problem(want, got)
    if kind == "messages":
        return messages_problem(want, got)
    if got is None:
        return "no picture"
    size = case.get("size", SIZE)
    problems = (pixel_problem(one, size, got) for one in want)
    return next((problem for problem in problems if problem), None)


def asked(reader, case):
    """Returns the kinds of results that a case states and the reader gives."""
    kinds = [kind for kind in KINDS if kind in case["expect"] and kind in reader.GIVES]
    if case.get("time") and not getattr(reader, "TIME", False):
        return []
    return [] if kinds == ["messages"] and case["expect"]["messages"] == "none" else kinds


def run_case(reader, name, path, case, folder):
    """Returns (result, reason); the results are pass, fail, refused and not asked."""
    if name.split("/")[0] not in reader.READS:
        return "not asked", ""
    kinds = asked(reader, case)
    if not kinds:
        return "not asked", ""
    try:
        answer = reader.read(path, kinds, case.get("size", SIZE), case.get("time", 0), folder)
    except Refused as refusal:
        if case.get("may be refused"):
            return "pass", ""
        return "refused", str(refusal)[:200]
    except Failed as failure:
        return "fail", str(failure)[:200]
    problems = [f"{kind}: {problem}" for kind in kinds for problem in [check(kind, case, answer)] if problem]
    return ("fail", "; ".join(problems)) if problems else ("pass", "")


def run_reader(name, only, show):
    reader = importlib.import_module(f"adapters.{name}")
    results = {}
    with tempfile.TemporaryDirectory() as folder:
        for case_name, path, case in cases(only):
            result, reason = run_case(reader, case_name, path, case, pathlib.Path(folder))
            results[case_name] = {"result": result, **({"reason": reason} if reason else {})}
            if show and result in ("fail", "refused"):
                print(f"{name}: {result}: {case_name}\n    {reason}\n    must be seen: {case['see']}")
    close = getattr(reader, "close", None)
    if close:
        close()
    return {"version": reader.version(), "date": datetime.date.today().isoformat(), "gives": list(reader.GIVES),
            "reads": list(reader.READS), "results": results}


def count(results, prefix):
    found = [r["result"] for name, r in results.items() if name.startswith(prefix)]
    return [found.count(kind) for kind in ("pass", "fail", "refused", "not asked")]


def table(answers):
    """Returns a Markdown table: pass / fail / refused of each reader by dialect and category."""
    names = list(answers)
    first = next(iter(answers.values()))["results"]
    rows = ["| | cases | " + " | ".join(names) + " |", "|---" * (len(names) + 2) + "|"]
    for dialect in DIALECTS:
        groups = sorted({name.rsplit("/", 1)[0] for name in first if name.startswith(dialect + "/")})
        if groups:
            rows.append(row(f"**{dialect}**", dialect + "/", answers))
            rows += [row(group.split("/")[1], group + "/", answers) for group in groups]
    rows.append(row("**all**", "", answers))
    return "\n".join(rows)


def row(title, prefix, answers):
    cells = []
    for answer in answers.values():
        passed, failed, refused, unasked = count(answer["results"], prefix)
        total = passed + failed + refused + unasked
        cells.append(f"{passed} / {failed} / {refused}" if passed + failed + refused else "")
    return f"| {title} | {total} | " + " | ".join(cells) + " |"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("readers", nargs="*", help="names of files in adapters/")
    parser.add_argument("--only", action="append", default=[], help="only cases with this in their name")
    parser.add_argument("--list", action="store_true", help="print each case that fails or is refused, with the reason")
    parser.add_argument("--json", type=pathlib.Path, help="write the results to this file; with --only those of other cases in it stay")
    parser.add_argument("--table", type=pathlib.Path, help="print the table of the results in this file")
    options = parser.parse_args()
    answers = {}
    if options.json and options.json.exists():
        answers = json.loads(options.json.read_text())
    if options.table:
        print(table(json.loads(options.table.read_text())))
        return 0
    if not options.readers:
        parser.error("name a reader, such as ivcam")
    for name in options.readers:
        earlier = answers.get(name, {}).get("results", {}) if options.only else {}
        answers[name] = run_reader(name, options.only, options.list)
        answers[name]["results"] = {**earlier, **answers[name]["results"]}
    if options.json:
        options.json.write_text(json.dumps(answers, indent=1) + "\n")
    chosen = {name: answers[name] for name in options.readers}
    print("pass / fail / refused; the rest is not asked\n")
    print(table(chosen))
    return int(any(count(answer["results"], "")[i] for answer in chosen.values() for i in (1, 2)))


if __name__ == "__main__":
    sys.modules["run"] = sys.modules["__main__"]
    sys.exit(main())
