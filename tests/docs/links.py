"""Every relative link, anchor and page that the repository's files name exists.

usage: links.py [FOLDER]

Reads what git tracks in FOLDER, by default this repository. Checks links and pictures of Markdown pages, anchors included, and, in every
text file, paths such as docs/guide/cmake.md. Templates, pages with {{…}}, are left out: their links are relative to where they go.
"""

import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
LINK = re.compile(r"\]\(<?([^)\s>]+)>?[^)]*\)")
PAGE = re.compile(r"(?<![\w/.-])(docs/[\w/.-]*\.md|(?:CONTRIBUTING|ARCHITECTURE|CHANGELOG)\.md)")


def prose(text):
    """The page without its program text, where brackets are no links."""
    text = re.sub(r"^(```|~~~).*?^\1", "", text, flags=re.M | re.S)
    return re.sub(r"`[^`\n]*`", lambda code: "`" + code[0][1:-1].replace("](", "] (") + "`", text)


def anchors(text):
    """The names that GitHub gives to headings."""
    seen, names = {}, set()
    for title in re.findall(r"^#{1,6} +(.+?) *#*$", re.sub(r"^(```|~~~).*?^\1", "", text, flags=re.M | re.S), re.M):
        title = re.sub(r"\[([^]]*)\]\([^)]*\)", r"\1", title)
        name = re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-")
        seen[name] = seen.get(name, -1) + 1
        names.add(f"{name}-{seen[name]}" if seen[name] else name)
    return names | set(re.findall(r'<a (?:id|name)="([^"]+)"', text))


def broken_links(root, page, text):
    """The links of a page that lead nowhere, in words."""
    for target in LINK.findall(prose(text)):
        if re.match(r"[a-z]+:", target):
            continue
        path, _, anchor = target.partition("#")
        place = (root / page).parent / path if path else root / page
        if not place.exists():
            yield f"{page}: no file {target}"
        elif anchor and anchor not in anchors(place.read_text(encoding="utf-8")):
            yield f"{page}: no heading {target}"


def broken_names(root, file, text):
    """The pages that a file names by their path from the root and that are not there."""
    for name in PAGE.findall(text):
        if not (root / name).exists():
            yield f"{file}: no page {name}"


def broken(root):
    files = subprocess.run(["git", "ls-files", "-co", "--exclude-standard"], cwd=root, capture_output=True, text=True, check=True).stdout.splitlines()
    for file in files:
        try:
            text = (root / file).read_text(encoding="utf-8")
        except (UnicodeDecodeError, FileNotFoundError):
            continue
        if file.endswith(".md") and "{{" not in text:
            yield from broken_links(root, file, text)
        if not file.startswith("tests/docs/"):
            yield from broken_names(root, file, text)


def main():
    found = list(broken(Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT))
    print("\n".join(found) if found else "links: OK")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
