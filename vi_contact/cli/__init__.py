"""Answer the command line ``vi-contact``: parse, call, print."""

from .entry import main

__all__ = ["main"]
