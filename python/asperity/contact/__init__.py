"""A single normal contact on NumPy arrays, without files, with and without adhesion."""

from .adhesive import AdhesiveNormalContact, solve_adhesive
from .normal import NormalContact, solve_normal

__all__ = ["AdhesiveNormalContact", "NormalContact", "solve_adhesive", "solve_normal"]
