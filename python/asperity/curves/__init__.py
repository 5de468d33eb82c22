"""From a road and a rubber to friction: curves over speed, pressure and temperature."""

from .curve import friction_curve, run_curve
from .plan import CurvePlan, plan_curve

__all__ = ["CurvePlan", "friction_curve", "plan_curve", "run_curve"]
