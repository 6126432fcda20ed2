"""Sections of a document that a benchmark writes, as docs.rs has them."""

from pathlib import Path


def put_section(path, name, text):
    """Puts `text` between the marks of the section `name`, or before the line "end of WHAT", WHAT being its first word."""
    begin, end, last = (f"<!-- {mark} -->\n" for mark in (f"begin {name}", f"end {name}", f"end of {name.split(' ')[0]}"))
    document = Path(path).read_text()
    if begin in document:
        before, rest = document.split(begin)
        after = rest.split(end)[1]
    else:
        before, after = document.split(last)
        after = "\n" + last + after
    Path(path).write_text(f"{before}{begin}\n{text}\n{end}{after}")
