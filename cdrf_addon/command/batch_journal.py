# SPDX-License-Identifier: GPL-3.0-or-later
"""Which pictures earlier runs have made, and with which settings: the journal beside them."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path

import bpy

from .batch_options import BatchOptions

VERSION = 1
"""Part of every key: raise it when the same settings make another picture."""
JOURNAL = "pictures.tsv"
# These choose pictures, or where they go; none changes what a picture shows.
NOT_IN_KEY = {"inputs", "output", "sigma0", "frames", "force"}


def settings_key(path: Path, options: BatchOptions) -> str:
    """Return a hash of all that decides an input's pictures apart from sigma0 and frame.

    Raises:
        OSError: The input is not there.
    """
    status = path.stat()
    settings = {name: value for name, value in options.as_json().items() if name not in NOT_IN_KEY}
    facts = (VERSION, str(path.resolve()), status.st_size, status.st_mtime_ns, settings)
    text = json.dumps([*facts, bpy.app.version_string], sort_keys=True)
    return hashlib.blake2b(text.encode(), digest_size=12).hexdigest()


def read_done(output: Path) -> dict[str, str]:
    """Read with which settings' key each picture was made; empty if there is no earlier run."""
    try:
        lines = (output / JOURNAL).read_text().splitlines()
    except (OSError, ValueError):
        return {}
    done: dict[str, str] = {}
    for line in lines:
        path, _, key = line.rpartition("\t")
        done[path] = key
    return done


def note_done(output: Path, target: Path, key: str) -> None:
    """Add a picture to the journal, at once, so that a killed run has it.

    Args:
        output: Folder of the journal.
        target: The picture.
        key: `settings_key` of its input.
    """
    with (output / JOURNAL).open("a") as journal:
        journal.write(f"{target}\t{key}\n")
