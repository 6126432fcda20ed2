"""The farm at a glance, by `make farm-demo`: 200 jobs on one worker and on two, then with a worker killed and the whole run killed
and resumed, then with a damaged cache entry, each compared by checksum with the undisturbed bake."""

import argparse
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

from shellwarp_farm import bake as baking
from shellwarp_farm import scaling
from shellwarp_farm.engine import Engine
from shellwarp_farm.errors import FarmError
from shellwarp_farm.job import RECORDS
from shellwarp_farm.job_log import FOLDER
from shellwarp_farm.scenes import expand, read_list

HERE = Path(__file__).resolve().parent


def records(out):
    """How many jobs have finished."""
    return sum(".partial" not in path.name for path in (out / RECORDS).rglob("*.json"))


def kill_a_run(path, out, after):
    """Bakes on two workers in a process of its own, and kills that when so many jobs are done."""
    command = [sys.executable, "-m", "shellwarp_farm", "bake", str(path), "--out", str(out), "--workers", "2", "--quiet"]
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL)
    while records(out) < after and process.poll() is None:
        time.sleep(0.02)
    process.kill()
    process.wait()
    time.sleep(1)   # its workers notice and end


def resume_with_a_worker_killed(todo, out, cache, after):
    """Goes on, and kills a worker when so many jobs are done: the report."""
    done = [0]
    with Engine(workers=2) as engine:
        def on_result(_result):
            done[0] += 1
            if done[0] == after:
                os.kill(next(iter(engine.client.run(os.getpid).values())), signal.SIGKILL)
        return baking.bake(engine, todo, out, cache, on_result=on_result)


def a_log(out):
    """That of a job that was tried twice in a run, of one that a run was killed in, or of any."""
    texts = [path.read_text() for path in sorted((out / FOLDER).rglob("*.log"))]
    return max(texts, key=lambda text: (text.count("again: "), text.count(" begins")))


def damage(cache):
    """Turns one bit of a cache entry over."""
    entry = sorted(cache.rglob("*.model"))[0]
    data = bytearray(entry.read_bytes())
    data[len(data) // 2] ^= 1
    entry.write_bytes(data)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--list", type=Path, default=HERE / "lists" / "demo.toml")
    parser.add_argument("--out", type=Path, default=Path("out/farm"))
    parser.add_argument("--runs", type=int, default=1, help="of one worker and of two")
    options = parser.parse_args()
    todo, disturbed = expand(read_list(options.list)), options.out / "disturbed"
    shutil.rmtree(disturbed, ignore_errors=True)
    print(f"== {len(todo)} jobs on one worker process, and on two")
    scaling.measure(todo, options.out, (1, 2), options.runs)
    undisturbed = options.out / "workers_2"

    print("== the same, the whole run killed in the middle, resumed, and a worker killed then")
    kill_a_run(options.list, disturbed, len(todo) // 3)
    print(f"killed with {records(disturbed)} of {len(todo)} jobs done")
    baking.print_report(resume_with_a_worker_killed(todo, disturbed, None, len(todo) // 2))
    problems = baking.verify(disturbed, undisturbed)

    print("== what one of its logs says")
    print(a_log(disturbed))
    print("== the same again, with a damaged cache entry")
    again = options.out / "rebuilt"
    shutil.rmtree(again, ignore_errors=True)
    damage(disturbed / "cache")
    with Engine(workers=2) as engine:
        report = baking.bake(engine, todo, again, disturbed / "cache")
    baking.print_report(report)
    problems += baking.verify(again, undisturbed) + ([] if report["damage"] else ["the damage went unnoticed"])
    print("\n".join(problems) or "every output is there once, with the checksum of the undisturbed bake")
    print("farm-demo: " + ("FAILED" if problems else "OK"))
    return 1 if problems else 0


if __name__ == "__main__":
    try:
        sys.exit(main())
    except FarmError as error:
        sys.exit(f"farm-demo: FAILED: {error}")
