"""Give layers of soil their materials and shaking."""

from __future__ import annotations

import vi_contact as vc

SHAKE = (vc.Ricker(2.0, 4.0), vc.Ricker(1.0, 6.0, direction=(0.0, 1.0)))
STIFF = vc.LinearElastic.from_wave_speeds(900.0, 500.0, 2200.0)


def middles(mesh):
    """Middles of the local cells."""
    from vi_contact.fem.compat import geometry_dofmap

    return mesh.geometry.x[geometry_dofmap(mesh)].mean(axis=1)
