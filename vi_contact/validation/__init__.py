"""Judge the package by experiments and published numbers: the validation book.

Every folder of ``entries`` is an entry: ``data.csv`` has the numbers of a source, ``entry.toml``
the inputs, the limits and the reason of each limit, ``run.py`` the computation. ``entry.py`` and
``data.py`` read and refuse, ``runner.py`` computes and judges, ``statistics.py`` says how well many
values agree, ``report.py`` and ``page.py`` tell it. ``vi-contact validate`` does all of it.
"""

from ..core.lazy import lazy

__all__, __getattr__, __dir__ = lazy(__name__, __file__)
