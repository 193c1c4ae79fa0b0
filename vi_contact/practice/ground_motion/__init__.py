"""Read, write, process and make ground motions: records, spectra, intensities, synthetic motions.

``read_record`` reads one, ``Processing`` makes another of it, ``GroundMotion`` shakes with it:
docs/guide/records.md.
>>> from vi_contact.practice.ground_motion import Record, pga, scaled
>>> print(pga(scaled(Record([0.0, 1.5, -3.0, 0.0], dt=0.01), factor=0.5)))  # m/s²
1.5
"""

from ...core.lazy import lazy

__all__, __getattr__, __dir__ = lazy(__name__, __file__)
