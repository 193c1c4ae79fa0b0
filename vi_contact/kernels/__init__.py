"""Hold the numerical kernels that bodies and solvers share, below both.

``contact_last`` factorises with contact unknowns last, ``condensation`` condenses onto them,
``friction_sweeps`` and ``exchanges`` begin small contact problems, and ``compiler`` compiles their
C files when they are first needed. No name of this room is public: its functions trust what they
are given.
"""
