"""Find the records that tests use where they are present."""

import os
from pathlib import Path

import pytest

SHARED = Path(
    os.environ.get(
        "VI_CONTACT_GROUND_MOTIONS",
        Path(__file__).resolve().parents[3] / "shared" / "ground_motions",
    )
)
EL_CENTRO, LOMA = "elcentro_1940_ns_peknold.at2", "lomaprieta_1989_sf_1295shafter_0111"


def shared(name):
    if not (SHARED / name).is_file():
        pytest.skip(f"development record {name} is not beside the checkout")
    return SHARED / name
