#!/usr/bin/env python3
"""Builds the C, C++ and command-line tests for each platform and runs them here: natively, under qemu or under Wine; `make test-platforms` calls it.

    run_portable.py [PLATFORM ...]

A platform whose compiler or emulator is missing is skipped with its name. What ran goes to build/dist/ran.json, for docs/reference/platforms.md.
"""

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "cmake"))
from dist import cmake, configure                        # noqa: E402
from dist_platforms import PLATFORMS, build_library      # noqa: E402
from emulator import environment                         # noqa: E402

RAN = ROOT / "build" / "dist" / "ran.json"
JOBS = os.environ.get("JOBS", "2")
PATIENCE = "3600"   # seconds until a test counts as hung: under qemu one that trains shells takes more than ten minutes


def missing(platform):
    if platform.macos and sys.platform != "darwin":
        return "macOS, which runs its programs"
    runner = platform.runner[:1]
    return platform.missing() or (f"{runner[0]}, which runs its programs" if runner and not shutil.which(runner[0]) else "")


def run(platform):
    """How many tests passed, and the names of those that failed."""
    build_library(platform)
    folder = configure(platform, "-DSHELLWARP_BUILD_TESTS=ON", "-DSHELLWARP_BUILD_HOSTS=OFF", folder=ROOT / "build" / "dist" / f"{platform.name}-tests")
    subprocess.run([cmake(), "--build", folder, "--parallel", JOBS], stdout=subprocess.DEVNULL, check=True)
    ctest = Path(cmake()).with_name("ctest")
    words = [ctest, "--test-dir", folder, "-L", "portable", "-LE", "scene", "-j", JOBS, "--timeout", PATIENCE]
    around = environment(platform, folder, [folder / "lib", platform.built().parent])
    if "windows" in platform.name:   # two first programs at once would both make Wine's prefix, and fail
        subprocess.run([*platform.runner, "cmd", "/c", "exit"], env=around, capture_output=True, check=True)
    done = subprocess.run(words, env=around, capture_output=True, text=True, check=False)
    (folder / "ctest.log").write_text(done.stdout + done.stderr, encoding="utf-8")
    results = re.findall(r"^ *\d+/\d+ Test +#\d+: (\S+) \.+ *(\**\w+)", done.stdout, re.M)
    if not results:
        sys.exit(f"run_portable: {platform.name}: no test ran\n{done.stdout}{done.stderr}")
    failed = [name for name, result in results if result != "Passed"]
    return len(results) - len(failed), failed


def main():
    names = sys.argv[1:] or list(PLATFORMS)
    unknown = [name for name in names if name not in PLATFORMS]
    if unknown:
        sys.exit(f"run_portable: no platform {unknown[0]}; there are {', '.join(PLATFORMS)}")
    bad, skipped = False, []
    for platform in [PLATFORMS[name] for name in names]:
        if why := missing(platform):
            skipped.append(f"{platform.name}: missing {why}")
            continue
        passed, failed = run(platform)
        bad |= bool(failed)
        by = platform.runner[0] if platform.runner else "native"
        print(f"run_portable: {platform.name} ({by}): {passed} passed, {len(failed)} failed{': ' if failed else ''}{', '.join(failed)}", flush=True)
        ran = json.loads(RAN.read_text(encoding="utf-8")) if RAN.exists() else {}
        ran[platform.name] = {**ran.get(platform.name, {}), "by": by, "passed": passed, "failed": failed}
        RAN.parent.mkdir(parents=True, exist_ok=True)
        RAN.write_text(json.dumps(ran, indent=1), encoding="utf-8")
    for line in skipped:
        print(f"run_portable: skipped: {line}")
    print(f"run_portable: {'FAILED' if bad else 'OK'}")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
