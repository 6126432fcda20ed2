"""docs/reference/scene.schema.json, by which editors complete and check scene files, says what the program reads.

usage: scene_schema.py PROGRAM [--write]

Keys, defaults and words come from docs/reference/scene.md, which the test scene_keys holds to the program; types and choices from what the program
says of a wrong value. Without --write: the file is current, it accepts every scene of tests/scenes and the one of `new-scene` with all that is
commented out, and it rejects what the program rejects.
"""

import json
import re
import subprocess
import sys
import tempfile
import tomllib
from pathlib import Path

from scene_keys import NO_VALUE, PAGE, ROOT, TABLES, tables_of_the_page

SCHEMA = ROOT / "docs" / "reference" / "scene.schema.json"
NO_WORD = '"no such word"'
NUMBERS = {"type": "array", "items": {"type": "number"}}
COUNT = {"type": "integer", "minimum": 0}
# What the program says of a value that no key accepts, and what it wants.
TYPES = [
    ("must be a number", lambda _: {"type": "number"}),
    ("must be a whole number", lambda _: COUNT),
    ("must be true or false", lambda _: {"type": "boolean"}),
    ("must be a text in quotes", lambda _: {"type": "string"}),
    (r"must be a list of (\d+) numbers", lambda m: {**NUMBERS, "minItems": int(m[1]), "maxItems": int(m[1])}),
    ("must be a list of numbers", lambda _: NUMBERS),
    ("must be a list of vertex indices", lambda _: {"type": "array", "items": COUNT}),
    ("must be a list of pairs of vertices", lambda _: {"type": "array", "items": {"type": "array", "items": COUNT, "minItems": 2, "maxItems": 2}}),
    ("must be a list, in quotes, of some of (.+)", lambda m: {"type": "array", "items": {"type": "string", "enum": m[1].split(", ")}}),
    ("must be a table", lambda _: "table"),
    ("must be written as", lambda _: "tables"),
]
# A sheet's constants are read only beside a sheet.
SHEET = ('mesh = "none.obj"\n[material]\npreset = "card"\nthickness = 1\n', "[[material.region]]", {"side": '"low-x"', "young": "1"})
# Tables that the page describes under another's name.
SAME = {"[[bone]] translate": "frame.translate", "[[bone]] rotate_degrees": "frame.rotate_degrees"}


def words():
    """By heading and key: its default and what the page says, without links."""
    found = {}
    for section in re.split(r"^## ", PAGE.read_text(encoding="utf-8"), flags=re.M)[1:]:
        heading = section.splitlines()[0].replace("`", "")
        for key, default, what in re.findall(r"^\| `(\w+)` \|(.*?)\|(.*)\|$", section, re.M):
            plain = (re.sub(r"\[(`.*?`|[^\]]*)\]\([^)]*\)", r"\1", text) for text in (default, what))
            found[heading, key] = [text.replace("`", "").strip() for text in plain]
    return found


def asked(program, scene, heading, key, value):
    """What the program says of this value."""
    before, header, needed = SHEET if heading == "[[material.region]]" and key in ("young", "thickness", "volume_density") else TABLES[heading]
    lines = [before + header, *(f"{k} = {v}" for k, v in {**needed, key: value}.items())]
    scene.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return subprocess.run([program, "run", scene], capture_output=True, text=True, check=False).stderr


def type_of(program, scene, heading, key):
    said = asked(program, scene, heading, key, NO_VALUE)
    for pattern, kind in TYPES:
        match = re.search(rf"\b{key} {pattern}", said)
        if match:
            kind = kind(match)
            break
    else:
        raise SystemExit(f"{heading} {key}: its type is not to be told from: {said}")
    if kind == {"type": "string"}:
        choices = re.search(r"'no such word'; (?:it must be one of|there are) ([\w, -]+)", asked(program, scene, heading, key, NO_WORD))
        if choices:
            return {**kind, "enum": choices[1].strip().split(", ")}
    return kind


def name_of(heading):
    return "top" if heading == "Top of the file" else heading.split(" of ")[0].strip("[]")


def schema(program):
    """One definition a table of the page; the two of [expect] are one."""
    said, definitions = words(), {}
    with tempfile.TemporaryDirectory() as folder:
        scene = Path(folder) / "scene.toml"
        for heading, keys in tables_of_the_page().items():
            name = name_of(heading)
            table = definitions.setdefault(name, {"type": "object", "additionalProperties": False, "properties": {}})
            for key in keys:
                default, what = said[heading, key]
                kind = type_of(program, scene, heading, key)
                if kind in ("table", "tables"):
                    inner = SAME.get(f"{heading} {key}", key if name in ("top", "shell") and key != "attach" else f"{name}.{key}")
                    kind = {"$ref": f"#/definitions/{inner}"} if kind == "table" else {"type": "array", "items": {"$ref": f"#/definitions/{inner}"}}
                else:
                    shown = "" if default in ("", "none", "required") else f" (default: {default})"
                    kind = {**kind, "description": f"{what}{shown}".strip() or key}
                table["properties"][key] = kind
                if default == "required" and key in TABLES[heading][2] and not what.startswith("of a "):
                    table.setdefault("required", []).append(key)
        # A comparison's numbers are called after methods.
        for heading in ("[expect] of a comparison", "[expect.reference]"):
            properties = definitions[name_of(heading)]["properties"]
            for method in definitions["simulation"]["properties"]["method"]["enum"]:
                for measure in ("error", "area_change"):
                    key = f"{method.replace('-', '_')}_{measure}"
                    if "must be" in asked(program, scene, heading, key, NO_VALUE):
                        properties[key] = properties[f"warp_{measure}"]
    top = definitions.pop("top")
    return {"$schema": "http://json-schema.org/draft-04/schema#", "title": "Scene of shellwarp", **top, "definitions": definitions}


def faults(value, rule, whole, at="scene"):
    """Where a value breaks a rule; of JSON Schema what the file uses."""
    if "$ref" in rule:
        rule = whole["definitions"][rule["$ref"].rsplit("/", 1)[1]]
    kinds = {"object": dict, "array": list, "string": str, "boolean": bool, "integer": int, "number": (int, float)}
    if not isinstance(value, kinds[rule["type"]]) or (isinstance(value, bool) and rule["type"] != "boolean"):
        return [f"{at}: {value} is no {rule['type']}"]
    found = []
    if "enum" in rule and value not in rule["enum"]:
        found.append(f"{at}: {value} is none of {rule['enum']}")
    if rule["type"] == "object":
        for key in rule.get("required", []):
            found += [] if key in value else [f"{at}: {key} is missing"]
        for key, inner in value.items():
            known = rule["properties"].get(key)
            found += faults(inner, known, whole, f"{at}.{key}") if known else [f"{at}: unknown key {key}"]
    if rule["type"] == "array":
        if not rule.get("minItems", 0) <= len(value) <= rule.get("maxItems", len(value)):
            found.append(f"{at}: {len(value)} items")
        for inner in value:
            found += faults(inner, rule["items"], whole, f"{at}[]")
    if rule["type"] == "integer" and value < rule.get("minimum", value):
        found.append(f"{at}: {value} is too small")
    return found


def new_scene(program, folder):
    """As it is, and with every line that is commented out and looks like TOML, but for choices beside another."""
    subprocess.run([program, "new-scene", folder / "new.toml"], check=True, capture_output=True)
    text = (folder / "new.toml").read_text(encoding="utf-8")
    beside = {"preset", "k_bend", "k_length", "k_area", "box", "vertices", "list", "group", "thickness"}
    lines, taken = [], set()
    for line in text.splitlines():
        match = re.match(r"# ((\w+) = .*|\[.*)", line)
        lines.append(match[1] if match and (match[2] not in beside or "[[material.crease]]" in taken) else line)
        taken.add(lines[-1].split(" ")[0])
    return text, "\n".join(lines)


def check(program):
    current = schema(program)
    text = SCHEMA.read_text(encoding="utf-8") if SCHEMA.exists() else ""
    wrong = [] if text == written(current) else ["docs/reference/scene.schema.json is not current: make scene-schema"]
    for path in sorted((ROOT / "tests" / "scenes").glob("*.toml")):
        wrong += [f"{path.name}: {fault}" for fault in faults(tomllib.loads(path.read_text(encoding="utf-8")), current, current)]
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        first, more = new_scene(program, folder)
        if first.splitlines()[0] != "#:schema ./scene.schema.json" or (folder / "scene.schema.json").read_text(encoding="utf-8") != text:
            wrong.append("new-scene does not name this schema in its first line, or does not write it beside")
        for scene in (first, more):
            wrong += [f"new-scene: {fault}" for fault in faults(tomllib.loads(scene), current, current)]
    for bad in ('mesh = 1', 'mesh = "a.obj"\nwinds = 1', 'mesh = "a.obj"\n[simulation]\nmethod = "wrap"', 'mesh = "a.obj"\n[wind]\ndensity = 1',
                'mesh = "a.obj"\n[[support]]\nbox = [1, 2]', 'mesh = "a.obj"\n[simulation]\nmodes = -1', 'mesh = "a.obj"\n[[material.crease]]\nedges = [[1]]'):
        if not faults(tomllib.loads(bad), current, current):
            wrong.append(f"the schema accepts {bad}")
    print("\n".join(wrong) if wrong else "scene schema: OK")
    return 1 if wrong else 0


def written(current):
    return json.dumps(current, indent=1, ensure_ascii=False) + "\n"


if __name__ == "__main__":
    if sys.argv[2:] == ["--write"]:
        SCHEMA.write_text(written(schema(sys.argv[1])), encoding="utf-8")
    else:
        sys.exit(check(sys.argv[1]))
