"""`python -m shellwarp demo`: a first motion to look at."""

import argparse
import sys
from pathlib import Path

from . import demo, library_path, version
from .errors import ShellwarpError


def main(words: "list[str] | None" = None) -> int:
    parser = argparse.ArgumentParser(prog="python -m shellwarp", description="Real-time thin shells by modal warping.")
    parser.add_argument("--version", action="store_true", help="the library's version, and where it was found")
    commands = parser.add_subparsers(dest="command")
    show = commands.add_parser("demo", help="drop a strip of card and write a page that plays it")
    show.add_argument("--out", type=Path, default=Path("shellwarp_demo.html"), help="the page, or a mesh where the name ends in .obj")
    given = parser.parse_args(words)
    try:
        if given.version:
            print(f"shellwarp {version()}, {library_path()}")
        elif given.command == "demo":
            print(demo.run(given.out))
        else:
            parser.print_help()
            return 2
    except (ShellwarpError, OSError) as error:
        print(f"shellwarp: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
