"""Dask's scheduler and workers: this machine's own by default, a farm's by its address."""

import itertools
import os
import time
import uuid

from .errors import FarmError

WINDOW_PER_WORKER = 64   # tasks under way at once for each worker, so that a list of millions does not lie in the scheduler


class Engine:
    """Tasks go in, futures come out as they finish. Use with `with`."""

    def __init__(self, scheduler=None, workers=None, retries=2):
        from distributed import Client, LocalCluster
        self.retries = retries
        self._cluster = None
        if scheduler is None:
            workers = workers or os.cpu_count()
            self._cluster = LocalCluster(n_workers=workers, threads_per_worker=1, processes=True, host="127.0.0.1",
                                         dashboard_address="127.0.0.1:0", env=environment(workers), silence_logs="ERROR")
            self._cluster.wait_for_workers(workers)
        try:
            self.client = Client(self._cluster or scheduler)
        except OSError as error:
            raise FarmError(f"no Dask scheduler at {scheduler}: {error}") from None
        if not self.workers():
            raise FarmError(f"the scheduler at {scheduler} has no workers")

    def workers(self):
        """Number of worker threads."""
        return sum(self.client.nthreads().values())

    def submit(self, function, *arguments, key):
        """A future. A task whose worker dies, or that raises, is tried again; `key` makes equal tasks one."""
        return self.client.submit(function, *arguments, key=key, retries=self.retries, pure=True)

    def stream(self, futures):
        """The futures of an iterator that submits as it is drawn from, as they finish; never too many at once."""
        from distributed import as_completed
        futures = iter(futures)
        running = as_completed(itertools.islice(futures, WINDOW_PER_WORKER * self.workers()))
        for future in running:
            yield future
            for following in itertools.islice(futures, 1):
                running.add(following)

    def __enter__(self):
        return self

    def __exit__(self, *exception):
        self.client.close()
        if self._cluster is not None:
            self._cluster.close()


def environment(workers):
    """Each of the workers of this machine takes its share of the cores, also for a precompute."""
    share = str(max(1, (os.cpu_count() or 1) // workers))
    return {"RAYON_NUM_THREADS": share, "OMP_NUM_THREADS": "1"}


def add_arguments(parser):
    """The engine's options on a command line."""
    parser.add_argument("--scheduler", metavar="tcp://HOST:PORT", help="a running Dask scheduler (default: this machine's own)")
    parser.add_argument("--workers", type=int, metavar="N", help="worker processes on this machine (default: its cores)")
    parser.add_argument("--retries", type=int, default=2, help="of a task that fails for want of disk, memory, … (default 2)")
    parser.add_argument("--quiet", action="store_true", help="no progress bar")


def result_of(future):
    """What a task returned, or {"failed"} with what it raised after all tries."""
    error = future.exception()
    return {"job": str(future.key), "failed": f"{future.key}: {type(error).__name__}: {error}"} if error else future.result()


def run_name():
    """Part of the keys of a run's tasks: Dask takes a task of equal key for done while anybody holds its result."""
    return uuid.uuid4().hex[:12]


def stopwatch():
    """A function that says how many seconds have passed."""
    start = time.perf_counter()
    return lambda: time.perf_counter() - start
