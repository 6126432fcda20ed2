"""Ctrl-C ends a run with the frames that there are: files and page are written, whole, and it says so; the exit status is 130. An equilibrium is given up
after the iteration under way, and leaves no files.

    python stopped_test.py PROGRAM MESH FOLDER
"""

import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

PROGRAM, MESH, OUT = sys.argv[1], sys.argv[2], Path(sys.argv[3])


def write_cloth(path, n):
    with open(path, "w") as file:
        file.writelines(f"v {i / (n - 1)} {j / (n - 1)} 0\n" for j in range(n) for i in range(n))
        for j in range(n - 1):
            for a in range(j * n + 1, j * n + n):
                file.write(f"f {a} {a + 1} {a + n + 1} {a + n}\n")


# Cotton held by two corners takes hundreds of iterations, a minute. It is stopped when the program first says that this is taking long, which is after two seconds.
def stop_an_equilibrium():
    cloth, folder = OUT / "cloth.obj", OUT / "rested"
    write_cloth(cloth, 91)
    command = [PROGRAM, "simulate", str(cloth), "--pin", "box:-1,-1,-1,0.05,0.01,1", "--pin", "box:0.95,-1,-1,2,0.01,1", "--up", "z", "--material", "cotton",
               "--method", "shell-implicit", "--static", "--out", str(folder)]
    run = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    heard = ""
    while "finding the equilibrium" not in heard:
        line = run.stderr.readline()
        if not line:
            sys.exit(f"it ended before it was stopped:\n{run.stdout.read()[-800:]}{heard}")
        heard += line
    run.send_signal(signal.SIGINT)
    said, complaint = run.communicate()
    if run.returncode != 130 or "its files are as they were" not in complaint or "equilibrium" in said:
        sys.exit(f"status {run.returncode}:\n{said[-800:]}{heard}{complaint}")
    if folder.exists() and list(folder.iterdir()):
        sys.exit(f"the folder holds {sorted(f.name for f in folder.iterdir())}")


def main():
    shutil.rmtree(OUT, ignore_errors=True)
    OUT.mkdir(parents=True)
    page = OUT / "strip.html"
    # It would take days. 100 frames of the cache are in the partial file before it is stopped, however slow the machine is.
    run = subprocess.Popen([PROGRAM, "simulate", MESH, "--pin", "low-x", "--up", "z", "--method", "shell-implicit", "--frames", "100000000", "--yes", "--out", str(OUT),
                            "--html", str(page)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    n = int(open(MESH).read().split()[1])
    while run.poll() is None and not any(f.stat().st_size > 100 * 12 * n for f in OUT.glob("*.pc2*")):
        time.sleep(0.05)
    run.send_signal(signal.SIGINT)
    said, complaint = run.communicate()
    cache = (OUT / "strip.pc2").read_bytes()
    frames = int.from_bytes(cache[28:32], "little")
    if run.returncode != 130 or "what is written ends there" not in complaint or frames < 90 or len(cache) != 32 + 12 * n * frames:
        sys.exit(f"status {run.returncode}, {frames} frames in {len(cache)} bytes:\n{said[-800:]}{complaint}")
    if f"stopped after frame {frames - 1};" not in complaint or "page: " not in said or "moved: " not in page.read_text():
        sys.exit(f"the page is not of {frames} frames:\n{said[-800:]}{complaint}")
    if list(OUT.glob("*.partial")) or not (OUT / "strip_frames.csv").exists():
        sys.exit(f"the folder holds {sorted(f.name for f in OUT.iterdir())}")
    stop_an_equilibrium()


main()
