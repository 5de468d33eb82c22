"""Friction curves: friction of a rubber on a road over speed, pressure and temperature."""

from .curve import friction_curve, run_curve
from .plan import CurvePlan, plan_curve

__all__ = ["CurvePlan", "friction_curve", "plan_curve", "run_curve"]
