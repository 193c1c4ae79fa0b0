"""Answer the command line ``vi-contact``: parse, call, print."""

from .main import main

__all__ = ["main"]
