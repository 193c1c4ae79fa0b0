"""Write the mesh of ``vi_contact.meshes.ball`` to a file, as ``python3 meshes ball …`` does."""

import sys
from pathlib import Path

if __name__ == "__main__":
    sys.path[0] = str(Path(__file__).resolve().parents[1])  # the source tree, maybe not installed
    from meshes.__main__ import main

    main([Path(__file__).stem, *sys.argv[1:]])
