"""Use the loops that a wheel has brought, where there is neither a compiler nor a cache.

``python3 tests/kernels/shipped_loops.py`` beside an installed wheel, outside of the clone.
"""

from __future__ import annotations

import os
import sys
from ctypes import c_double

os.environ |= {"CC": "/no/compiler", "XDG_CACHE_HOME": "/no/cache"}

from vi_contact.core.algebra import SerialComm
from vi_contact.kernels import compiler


def main() -> None:
    """Say which file serves, or fail."""
    shipped = compiler.find_shipped()
    loops = compiler.load_loops(SerialComm())
    if shipped is None or loops is None:
        sys.exit(f"no compiled loops in {compiler.HERE}")
    assert loops.relax.restype is c_double
    print(f"the loops are those of {shipped.name}")


if __name__ == "__main__":
    main()
