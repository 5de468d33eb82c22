"""One contact on numpy arrays, without files: normal contact, with and without adhesion."""

from .adhesive import AdhesiveNormalContact, solve_adhesive
from .normal import NormalContact, solve_normal

__all__ = ["AdhesiveNormalContact", "NormalContact", "solve_adhesive", "solve_normal"]
