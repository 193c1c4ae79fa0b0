"""Answer the command line ``vi-contact``: parse, call, print.

``entry.py`` lists the commands; ``case.py``, ``ida.py``, ``motion.py``, ``pictures.py``,
``post.py`` and ``validate.py`` hold them. They call what ``studies``, ``ground_motion``,
``plots`` and the room ``vi_contact.validation`` offer in Python.
``main(["run", "wall", "--check"])`` is the command ``vi-contact run wall --check``, and returns its
status; ``status_of(call)`` ends a script of your own likewise. docs/guide/studies.md.
"""

from .entry import main, status_of

__all__ = ["main", "status_of"]
