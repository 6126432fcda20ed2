"""What the programs of a platform need around them to run on this machine."""

import os
import subprocess
from pathlib import Path

SHIM = Path(__file__).resolve().parent / "process_prng.c"


def environment(platform, folder, libraries):
    """Of Wine: a prefix and a shim for what Wine 8 lacks, both in `folder`, and the folders of the DLLs. Of others: this machine's own."""
    own = {key: value for key, value in os.environ.items() if not key.startswith(("SHELLWARP", "LD_", "PYTHON"))}
    if "windows" not in platform.name:
        return own
    shim = folder / "shim"
    if not shim.exists():
        shim.mkdir()
        subprocess.run([platform.needs[0], "-shared", "-O2", "-o", shim / "bcryptprimitives.dll", SHIM, "-ladvapi32"], check=True)
    return own | {"WINEPREFIX": str(folder / "wine"), "WINEDEBUG": "-all", "WINEPATH": ";".join(map(str, [shim, *libraries]))}
