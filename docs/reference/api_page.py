"""Writes docs/reference/api.md, the C interface as a page, from include/shellwarp.h; `make docs-api` calls it.

usage: api_page.py HEADER > PAGE

The header is written by cbindgen, so its C is plain: a comment of lines with //, then one declaration. A line such as
`/* Meshes ---- */` begins a section. Anything else is an error here, not a guess.
"""

import re
import sys

SECTION = re.compile(r"/\* (.+?) -{3,} \*/")
CONSTANT = re.compile(r"#define (SW_\w+) (\S+)")
STRUCT = re.compile(r"typedef struct (\w+) \{")
NAMED = re.compile(r"typedef (?:struct \w+ (\w+)|[\w ]+?\(\*(\w+)\)\(.*\)|\w+ (\w+));", re.S)
FUNCTION = re.compile(r"[\w *]*?\b(sw_\w+)\(.*\);", re.S)
FIELD = re.compile(r"(.+?)(\w+(?:\[\w+\])?);")


class Reader:
    """The lines of the header, one declaration after the other."""

    def __init__(self, text):
        found = re.match(r"/\*(.*?)\*/", text, re.S)
        self.intro = [re.sub(r"^ ?\* ?", "", line) for line in found[1].splitlines()] if found else []
        text = re.sub(r"#ifdef __cplusplus\n.*?#endif[^\n]*\n", "", text, flags=re.S)
        text = re.sub(r"#ifndef SHELLWARP_NO_INLINE\n.*?#endif[^\n]*\n", "", text, flags=re.S)
        lines = text[found.end() if found else 0 :].splitlines()
        self.lines = [line for line in lines if not re.match(r"#(ifndef|define) SHELLWARP_H|#include|#endif", line)]
        self.at = 0

    def done(self):
        while self.at < len(self.lines) and not self.lines[self.at].strip():
            self.at += 1
        return self.at == len(self.lines)

    def comment(self):
        """The lines of a comment, their marks taken off."""
        begin = self.at
        while self.at < len(self.lines) and self.lines[self.at].strip().startswith("//"):
            self.at += 1
        return [line.strip()[2:].strip() for line in self.lines[begin : self.at]]

    def until(self, end):
        """The lines up to the one that ends so."""
        begin = self.at
        while not self.lines[self.at].rstrip().endswith(end):
            self.at += 1
        self.at += 1
        return self.lines[begin : self.at]


def fields(reader):
    """Name, type and text of each field of a struct, up to its end."""
    while not reader.lines[reader.at].startswith("}"):
        text = reader.comment()
        found = FIELD.fullmatch(reader.lines[reader.at].strip())
        if not found:
            raise ValueError(f"a field that is not understood: {reader.lines[reader.at]}")
        reader.at += 1
        yield found[2], found[1].strip(), text
    reader.at += 1


def declarations(reader):
    """Sections, constants, structs, types and functions in the header's order: kind, name, what it has, text."""
    while not reader.done():
        text = reader.comment()
        if reader.done():
            yield "note", "", None, text
            break
        line = reader.lines[reader.at]
        if found := SECTION.fullmatch(line.strip()):
            reader.at += 1
            yield "section", found[1], None, text
        elif found := CONSTANT.fullmatch(line):
            reader.at += 1
            yield "constant", found[1], found[2], text
        elif found := STRUCT.fullmatch(line):
            reader.at += 1
            yield "struct", found[1], list(fields(reader)), text
        elif not line.startswith("//"):
            code = "\n".join(reader.until(";"))
            if found := NAMED.fullmatch(code) or FUNCTION.fullmatch(code):
                yield "function" if found.re is FUNCTION else "type", next(filter(None, found.groups())), code, text
            else:
                raise ValueError(f"a declaration that is not understood: {code}")


class Page:
    """Markdown of all declarations; names in the text are links."""

    def __init__(self, intro, declared):
        self.headings = {name for kind, name, _, _ in declared if kind in ("struct", "type", "function")}
        self.lines = ["# The C interface", "", "Written from `include/shellwarp.h` by `make docs-api`; do not edit.", ""]
        self.lines += self.paragraphs(intro) + [""]
        self.in_table = False
        for kind, *rest in declared:
            if kind != "constant" and self.in_table:
                self.lines.append("")
            self.in_table = kind == "constant" and self.in_table
            getattr(self, kind)(*rest)

    def text(self, words):
        """A line of prose, safe in Markdown."""
        words = re.sub(r"([|<>*\[\]])", r"\\\1", words)
        return re.sub(r"\b(?:sw_|Sw[A-Z]|SW_)\w*(?:\.\.\.\w*)?", self.name, words)

    def name(self, found):
        name = found[0]
        return f"[`{name}`](#{name.lower()})" if name in self.headings else f"`{name}`"

    def paragraphs(self, lines):
        """An empty line or a deeper one begins a new paragraph."""
        parts = re.split(r"\n\s*\n|\n(?=  \S)(?!    )", "\n".join(lines).strip("\n"))
        texts = [self.text(" ".join(part.split())) for part in parts]
        return [line for text in texts for line in (text, "")][:-1]

    def section(self, name, _, text):
        self.lines += [f"## {name}", ""] + ([*self.paragraphs(text), ""] if text else [])

    def note(self, _, __, text):
        self.lines += [*self.paragraphs(text), ""]

    def constant(self, name, value, text):
        if not self.in_table:
            self.lines += ["| constant | value | |", "|---|---|---|"]
            self.in_table = True
        self.lines.append(f"| `{name}` | {value} | {self.text(' '.join(text))} |")

    def heading(self, name, text):
        self.lines += [f"### {name}", ""] + ([*self.paragraphs(text), ""] if text else [])

    def struct(self, name, listed, text):
        self.heading(name, text)
        self.lines += ["| field | type | |", "|---|---|---|"]
        self.lines += [f"| `{field}` | `{kind}` | {self.text(' '.join(words))} |" for field, kind, words in listed]
        self.lines.append("")

    def type(self, name, code, text):
        self.function(name, code, text)

    def function(self, name, code, text):
        self.lines += [f"### {name}", "", "```c", code, "```", ""] + ([*self.paragraphs(text), ""] if text else [])


def page(header):
    reader = Reader(header)
    return "\n".join(Page(reader.intro, list(declarations(reader))).lines).rstrip() + "\n"


def main():
    with open(sys.argv[1], encoding="utf-8") as file:
        sys.stdout.write(page(file.read()))


if __name__ == "__main__":
    main()
