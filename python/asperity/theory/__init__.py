"""Known solutions of contact mechanics, for comparison with computed contacts.

The conventions are those of the program: SI units, E* = E/(1 - nu^2) = 2 G/(1 - nu). A rigid body
is pressed onto a half-space. Displacements are positive into the half-space, and pressures are
positive in compression.

Elastic: `hertz`, `hertz_line`, `westergaard`, `persson_area`, `bush_gibson_thomas`.
Adhesive: `jkr`, `dmt`, `maugis`, `tabor_parameter`.
Friction: `mindlin`.
Viscoelastic: `lee_radok`, `hunter`, `full_contact_waves`, `persson`, `persson_speed_step`.
Spectra: `self_affine_psd`, `surface_psd`, `psd_moments`.
"""

from __future__ import annotations

from .adhesive import AdhesiveContact, dmt, jkr, maugis, tabor_parameter
from .hertzian import HertzContact, HertzLine, hertz, hertz_line
from .rough import (
    bush_gibson_thomas,
    persson_area,
    psd_moments,
    self_affine_psd,
    surface_psd,
)
from .sliding_rough import PerssonContact, persson
from .speed_step import persson_speed_step
from .tangential import MindlinContact, mindlin
from .viscoelastic import HunterContact, LeeRadokContact, hunter, lee_radok
from .wavy import FullContactWaves, WestergaardContact, full_contact_waves, westergaard

__all__ = [
    "AdhesiveContact",
    "FullContactWaves",
    "HertzContact",
    "HertzLine",
    "HunterContact",
    "LeeRadokContact",
    "MindlinContact",
    "PerssonContact",
    "WestergaardContact",
    "bush_gibson_thomas",
    "dmt",
    "full_contact_waves",
    "hertz",
    "hertz_line",
    "hunter",
    "jkr",
    "lee_radok",
    "maugis",
    "mindlin",
    "persson",
    "persson_area",
    "persson_speed_step",
    "psd_moments",
    "self_affine_psd",
    "surface_psd",
    "tabor_parameter",
    "westergaard",
]
