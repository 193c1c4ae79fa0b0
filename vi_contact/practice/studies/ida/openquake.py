"""Write fragility curves for OpenQuake: a fragility model in NRML 0.5.

A lognormal curve is stated by the mean m and the standard deviation s of the capacity, in the unit
of the intensity, and not by its median theta and dispersion beta:

    m = theta exp(beta²/2),    s = m sqrt(exp(beta²) - 1)

OpenQuake Engine, Reference Manual, "Fragility Models", continuous functions of shape logncdf.
"""

import math
import xml.etree.ElementTree as ET
from collections.abc import Mapping
from pathlib import Path

from ....core.errors import InputError
from ....core.files import write_output
from .fragility import Fragility

SPACE = "http://openquake.org/xmlns/nrml/0.5"
G = 9.80665  # m/s²: OpenQuake takes accelerations in it
CM = 0.01  # m/s: and velocities in cm/s
_MEASURES = {"pga": ("PGA", G), "pgv": ("PGV", CM), "pgd": ("PGD", CM), "cav": ("CAV", G)}


def name_measure(measure: str) -> tuple[str, float] | None:
    """Return OpenQuake's name of an intensity, and its unit in SI; None where it has none.

    Args:
        measure: as its column of ida.csv, such as "pga" or "sa_0.5".
    """
    if measure.startswith("sa_"):
        return f"SA({float(measure.removeprefix('sa_')):g})", G
    return _MEASURES.get(measure)


def make_mean_and_deviation(theta: float, beta: float) -> tuple[float, float]:
    """Return mean and standard deviation of a lognormal capacity, in the unit of theta."""
    mean = theta * math.exp(0.5 * beta**2)
    return mean, mean * math.sqrt(math.expm1(beta**2))


def write_fragility_model(
    path: str | Path, curves: Mapping[str, Fragility], measure: str, *, taxonomy: str
) -> Path:
    """Write a fragility model: one function whose limit states are the limits.

    OpenQuake asks that each limit state is at least as likely as the next one. So they stand by
    their medians. Curves of other dispersions cross far from them.

    Args:
        path: the file.
        curves: limit -> its curve.
        measure: of the intensity, as its column of ida.csv.
        taxonomy: name of the structure, by which an exposure model refers to it.

    Returns:
        The path of the file.

    Raises:
        InputError: OpenQuake has no such intensity, or there is no curve.
    """
    known = name_measure(measure)
    if known is None:
        raise InputError(
            f"OpenQuake: the intensity '{measure}' is none of its own; take pga, pgv, pgd, cav or "
            "sa:T"
        )
    if not curves:
        raise InputError("OpenQuake: there is no fragility curve to write")
    name, unit = known
    ordered = sorted(curves, key=lambda limit: curves[limit].theta)

    # The range of intensities in which the curves say something: from one record in a thousand to
    # all but one.
    low = min(curve.theta * math.exp(-3.09 * curve.beta) for curve in curves.values())
    high = max(curve.theta * math.exp(3.09 * curve.beta) for curve in curves.values())
    root = ET.Element("nrml", xmlns=SPACE)
    model = ET.SubElement(
        root,
        "fragilityModel",
        id="vi_contact",
        assetCategory="buildings",
        lossCategory="structural",
    )
    ET.SubElement(model, "description").text = f"fragility over {name}, from runs of vi_contact"
    states = [f"ds{number}" for number in range(1, len(ordered) + 1)]
    ET.SubElement(model, "limitStates").text = " ".join(states)
    function = ET.SubElement(
        model, "fragilityFunction", id=taxonomy, format="continuous", shape="logncdf"
    )
    ET.SubElement(
        function,
        "imls",
        imt=name,
        noDamageLimit=repr(low / unit),
        minIML=repr(low / unit),
        maxIML=repr(high / unit),
    )
    for state, limit in zip(states, ordered, strict=True):
        function.append(ET.Comment(f" {state}: {limit} ".replace("--", "- -")))
        mean, deviation = make_mean_and_deviation(curves[limit].theta, curves[limit].beta)
        ET.SubElement(
            function, "params", ls=state, mean=repr(mean / unit), stddev=repr(deviation / unit)
        )
    ET.indent(root)
    write_output(path, b'<?xml version="1.0" encoding="utf-8"?>\n' + ET.tostring(root) + b"\n")
    return Path(path)
