"""Bakes a list with different numbers of workers, each into a folder of its own, and compares times and checksums.

On a machine that others use, workers share its cores with them, and the ratio says little; the share of the time that workers
spend in jobs is what the engine answers for."""

import argparse
import shutil
import statistics
from pathlib import Path

from . import engine as engines
from .bake import bake
from .errors import FarmError
from .scenes import expand, read_list


def main(arguments):
    parser = argparse.ArgumentParser(prog="shellwarp_farm scaling", description=__doc__.splitlines()[0])
    parser.add_argument("list", type=Path, help="scene list, TOML")
    parser.add_argument("--out", type=Path, required=True, help="folder for the bakes; what the last had there is removed")
    parser.add_argument("--counts", type=int, nargs="+", default=[1, 2], help="numbers of workers (default 1 2)")
    parser.add_argument("--runs", type=int, default=3, help="of each, in turns (default 3)")
    options = parser.parse_args(arguments)
    measure(expand(read_list(options.list)), options.out, options.counts, options.runs)
    return 0


def measure(todo, out, counts=(1, 2), runs=3):
    """Prints a line for each run and the ratios; seconds by number of workers, from the first task to the manifest."""
    seconds, digests = {count: [] for count in counts}, set()
    for run in range(runs):
        for count in counts:
            folder = Path(out) / f"workers_{count}"
            shutil.rmtree(folder, ignore_errors=True)
            with engines.Engine(workers=count) as engine:
                report = bake(engine, todo, folder)
            if report["failed"]:
                raise FarmError(report["failed"][0])
            seconds[count].append(report["seconds"])
            digests.add(report["digest"])
            print(f"run {run + 1}: {len(todo)} jobs, {count} workers: {report['seconds']:.2f} s, "
                  f"in jobs {100 * report['busy']:.0f} % of the time, {report['core_seconds']:.1f} core-seconds", flush=True)
    for count in counts[1:]:
        ratios = [first / other for first, other in zip(seconds[counts[0]], seconds[count])]
        print(f"{count} workers are {statistics.median(ratios):.2f} times as fast as {counts[0]} "
              f"(median of {runs}; {min(ratios):.2f} to {max(ratios):.2f})")
    if len(digests) != 1:
        raise FarmError("the outputs depend on the number of workers")
    print(f"the same checksum of all outputs every time: {digests.pop()}")
    return seconds
