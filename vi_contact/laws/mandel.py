"""Write symmetric tensors as vectors whose products are those of the tensors (Mandel's notation).

    plane strain (xx, yy, zz, √2 xy),    space (xx, yy, zz, √2 xy, √2 yz, √2 xz)

sigma : eps is then the inner product of two vectors, and one code serves n = 4 and n = 6. Tension
is positive. In plane strain zz is a component of its own: it has a stress, and a plastic strain.
Arrays have an axis of points first, and the components last.
"""

import numpy as np

from ..core.algebra import Array

PAIRS = {4: ((0, 1),), 6: ((0, 1), (1, 2), (0, 2))}
"""Which shears (i, j) follow the three normal components, by the number of components."""
ROOT = float(np.sqrt(2.0))


def identity(n: int) -> Array:
    """Return the unit tensor (n,)."""
    unit = np.zeros(n)
    unit[:3] = 1.0
    return unit


def deviator_matrix(n: int) -> Array:
    """Return the matrix (n, n) that takes a tensor to its deviator."""
    unit = identity(n)
    return np.eye(n) - np.outer(unit, unit) / 3.0


def trace(x: Array) -> Array:
    """Return the trace (…,) of tensors (…, n)."""
    return x[..., 0] + x[..., 1] + x[..., 2]


def deviator(x: Array) -> Array:
    """Return the deviators (…, n) of tensors (…, n)."""
    out = x.copy()
    out[..., :3] -= (trace(x) / 3.0)[..., None]
    return out


def dot(x: Array, y: Array) -> Array:
    """Return x : y (…,) of tensors (…, n)."""
    product: Array = np.einsum("...i,...i->...", x, y)
    return product


def norm(x: Array) -> Array:
    """Return √(x : x) (…,) of tensors (…, n)."""
    return np.sqrt(dot(x, x))


def over(x: Array, size: Array) -> Array:
    """Return x/size (…, n), and zero where the size (…,) is zero."""
    divisor = np.where(size > 0.0, size, 1.0)[..., None]
    return np.where((size > 0.0)[..., None], x / divisor, 0.0)


def elastic_matrix(bulk: float, shear: float, n: int) -> Array:
    """Return C (n, n) [Pa] of sigma = bulk tr(eps) 1 + 2 shear dev(eps)."""
    unit = identity(n)
    return bulk * np.outer(unit, unit) + 2.0 * shear * deviator_matrix(n)


def to_tensors(x: Array) -> Array:
    """Return tensors (…, 3, 3) of vectors (…, n)."""
    out = np.zeros((*x.shape[:-1], 3, 3))
    for i in range(3):
        out[..., i, i] = x[..., i]
    for place, (i, j) in enumerate(PAIRS[x.shape[-1]]):
        out[..., i, j] = x[..., 3 + place] / ROOT
        out[..., j, i] = out[..., i, j]
    return out


def to_vectors(tensors: Array, n: int) -> Array:
    """Return vectors (…, n) of symmetric tensors (…, 3, 3)."""
    parts = [tensors[..., i, i] for i in range(3)]
    parts += [ROOT * tensors[..., i, j] for i, j in PAIRS[n]]
    return np.stack(parts, axis=-1)


def find_principal(x: Array) -> tuple[Array, Array]:
    """Return principal values and axes of tensors (q, n).

    In plane strain z is an axis, and the two others have a closed form.

    Returns:
        Values (q, 3), the largest first, and axes (q, 3, 3), the columns of each matrix.
    """
    if x.shape[-1] == 6:
        values, axes = np.linalg.eigh(to_tensors(x))
        return values[:, ::-1], axes[:, :, ::-1]
    mean = 0.5 * (x[:, 0] + x[:, 1])
    half = 0.5 * (x[:, 0] - x[:, 1])
    shear = x[:, 3] / ROOT
    radius = np.hypot(half, shear)
    angle = 0.5 * np.arctan2(shear, half)
    c = np.cos(angle)
    s = np.sin(angle)
    values = np.stack([mean + radius, mean - radius, x[:, 2]], axis=1)
    axes = np.zeros((len(x), 3, 3))
    axes[:, 0, 0] = c
    axes[:, 1, 0] = s
    axes[:, 0, 1] = -s
    axes[:, 1, 1] = c
    axes[:, 2, 2] = 1.0
    order = np.argsort(-values, axis=1, kind="stable")
    sorted_axes = np.take_along_axis(axes, order[:, None, :], axis=2)
    return np.take_along_axis(values, order, axis=1), sorted_axes


def make_basis(axes: Array, n: int) -> tuple[Array, Array]:
    """Return the unit tensors of axes (q, 3, 3): of stretches along them, and of shears.

    Returns:
        (q, 3, n) of n_i ⊗ n_i, and (q, 3, n) of √2 sym(n_i ⊗ n_j) for (i, j) = 01, 12, 02.
    """
    columns = axes.swapaxes(1, 2)
    stretches = np.einsum("qai,qaj->qaij", columns, columns)
    shears = []
    for i, j in PAIRS[6]:
        product = np.einsum("qi,qj->qij", columns[:, i], columns[:, j])
        shears.append((product + product.swapaxes(1, 2)) / ROOT)
    return to_vectors(stretches, n), to_vectors(np.stack(shears, axis=1), n)
