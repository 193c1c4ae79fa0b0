"""Hold what serves the practice of engineers, around the contact itself.

``ground_motion`` reads records, ``soil`` brings the motion of the ground to a body, ``engineering``
sets checks and spectra beside a run, ``plots`` draws it, ``studies`` reads case files and runs many
of them, and ``cli`` is the command ``vi-contact``. The rooms beside this one import none of these.
``from vi_contact import soil`` is short for ``from vi_contact.practice import soil``.
"""
