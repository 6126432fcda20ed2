"""logs/JOB.log: what became of a job, a line each with the time (UTC) and the worker.

Every try adds to it. So it tells why there was another: what the try before raised, or that its worker ended without a word."""

import os
import re
import socket
import threading
import traceback
from contextlib import contextmanager
from datetime import datetime, timezone
from pathlib import Path

import shellwarp

FOLDER = "logs"
LINE = re.compile(r"\S+ (?P<worker>\S+) run (?P<run>\S+) try (?P<number>\d+) (?P<what>begins|ends|failed: (?P<reason>.*))")


class JobLog:
    """One try of a job in a run. The file is opened for every line: a worker that is killed loses none."""

    def __init__(self, out, name, run):
        self.path, self._run = log_path(out, name), run
        self.path.parent.mkdir(parents=True, exist_ok=True)
        self.reasons = reasons(out, name, run)   # why there was another try in this run, one for each
        self.number = len(self.reasons) + 1
        self._say("begins")
        if self.reasons:
            self.say(f"again: {self.reasons[-1]}")

    def say(self, text):
        """A line of what happens."""
        self._write(f"  {text}")

    def end(self, text):
        self.say(text)
        self._say("ends")

    def fail(self, error):
        """What the try raised, which another may mend."""
        self._say(f"failed: {type(error).__name__}: {error}")
        for line in "".join(traceback.format_exception(error)).rstrip().splitlines():
            self.say(line)

    def _say(self, text):
        self._write(f"run {self._run} try {self.number} {text}")

    def _write(self, text):
        now = datetime.now(timezone.utc).strftime("%Y-%m-%dT%H:%M:%SZ")
        with open(self.path, "a", encoding="utf-8") as file:
            file.write("".join(f"{now} {_worker()} {line}\n" for line in text.splitlines()))


def log_path(out, name):
    return Path(out) / FOLDER / f"{name}.log"


def reasons(out, name, run):
    """What ended each try of a job in a run so far."""
    try:
        lines = log_path(out, name).read_text(encoding="utf-8").splitlines()
    except FileNotFoundError:
        return []
    found = {}
    for match in filter(None, map(LINE.match, lines)):
        if match["run"] == run:
            silent = f"{match['worker']} ended without a word: killed, or out of memory"
            found[int(match["number"])] = match["reason"] or (silent if match["what"] == "begins" else "done, and its result was lost")
    return [found[number] for number in sorted(found)]


_heard = threading.local()
_installed = []


@contextmanager
def library_messages(receiver):
    """Hands the library's messages of this thread to receiver(text)."""
    if not _installed:
        _installed.append(shellwarp.set_log(_hear))
    before, _heard.receiver = getattr(_heard, "receiver", None), receiver
    try:
        yield
    finally:
        _heard.receiver = before


def tell(text):
    """Says something where the library's messages of this thread go."""
    receiver = getattr(_heard, "receiver", None)
    if receiver:
        receiver(text)


def _hear(level, message):
    tell(f"{level}: {message}")


def _worker():
    return f"{socket.gethostname()}:{os.getpid()}"
