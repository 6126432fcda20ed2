"""python -m shellwarp_farm COMMAND …"""

import sys

from . import bake, costs, scaling, sweep
from .errors import FarmError

COMMANDS = {"bake": bake.main, "verify": bake.verify_main, "scaling": scaling.main, "sweep": sweep.main, "costs": costs.main}


def main(arguments):
    if not arguments or arguments[0] not in COMMANDS:
        print(f"usage: python -m shellwarp_farm {{{','.join(COMMANDS)}}} … (--help for each)", file=sys.stderr)
        return 2
    try:
        return COMMANDS[arguments[0]](arguments[1:])
    except FarmError as error:
        print(f"shellwarp_farm: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print("shellwarp_farm: stopped; the same command goes on from here", file=sys.stderr)
        return 130


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
