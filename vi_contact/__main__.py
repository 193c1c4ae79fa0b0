"""``python3 -m vi_contact``: the command line."""

from .practice.cli.entry import main

if __name__ == "__main__":
    raise SystemExit(main())
