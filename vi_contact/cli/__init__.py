"""Answer the command line ``vi-contact``: parse, call, print.

``entry.py`` lists the commands; ``case.py``, ``ida.py``, ``motion.py`` and ``report.py`` hold them, and call what
``studies``, ``ground_motion`` and ``plots`` offer in Python. ``main(["run", "wall", "--check"])`` is the command
``vi-contact run wall --check``, and returns its status. docs/guide/studies.md."""

from .entry import main

__all__ = ["main"]
