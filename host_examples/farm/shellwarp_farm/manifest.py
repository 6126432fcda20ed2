"""manifest.jsonl: a line for each job, sorted by name, from the records that the workers wrote."""

import hashlib
import json
from pathlib import Path

from . import files
from .errors import FarmError

NAME = "manifest.jsonl"


def write(out, records):
    """The manifest of these records, written whole."""
    lines = (json.dumps(record, sort_keys=True) for record in sorted(records, key=lambda record: record["job"]))
    files.write_whole(Path(out) / NAME, "".join(f"{line}\n" for line in lines).encode())


def read(out):
    """The records."""
    try:
        return [json.loads(line) for line in (Path(out) / NAME).read_text().splitlines()]
    except FileNotFoundError:
        raise FarmError(f"{out} has no {NAME}: nothing was baked to its end there") from None


def outputs(records):
    """Every output's checksum by its path. A path that comes twice is an error."""
    found = {}
    for record in records:
        for path, facts in record["outputs"].items():
            if found.setdefault(path, facts["sha256"]) != facts["sha256"]:
                raise FarmError(f"{path} is an output of two jobs")
    return found


def digest(records):
    """One checksum of all outputs: equal for equal bakes, however they came about."""
    lines = "".join(f"{sha256}  {path}\n" for path, sha256 in sorted(outputs(records).items()))
    return hashlib.sha256(lines.encode()).hexdigest()
