"""Hold the names that have changed since version 0.2.0, so that old programs are told the new ones.

A name stays here for the versions that docs/reference/releases.md promises. ``core.lazy`` gives the
thing of the new name with a DeprecationWarning, and a case file with an old word is read with a
warning in the log.
"""

from __future__ import annotations

# Package -> old public name -> dotted path of the new one.
NAMES: dict[str, dict[str, str]] = {
    "vi_contact.practice.engineering.checks": {
        "Coulomb": "vi_contact.practice.engineering.checks.CoulombWedge"
    },
    "vi_contact.practice.engineering": {
        "Racking": "vi_contact.Racking",
        "Resultants": "vi_contact.Resultants",
    },
    "vi_contact.fem": {
        "LargestStrain": "vi_contact.LargestStrain",
        "Reactions": "vi_contact.Reactions",
        "SectionForces": "vi_contact.SectionForces",
    },
}

# Table of a case file -> old key -> new key.
KEYS: dict[str, dict[str, str]] = {
    "system": {"clamped": "fixed"},
    "contact": {"held": "roller"},
}

# Old word of a case file or an option -> new word.
WORDS: dict[str, str] = {
    "Coulomb": "CoulombWedge",  # of [[check]]: the friction law keeps the name
}
