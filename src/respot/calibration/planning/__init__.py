"""Which further spots to measure: design of experiments over the spots of a program."""

from respot.calibration.planning.plan import Plan, PlannedSpot, SourcePlan, plan_source, plan_spots

__all__ = ["Plan", "PlannedSpot", "SourcePlan", "plan_source", "plan_spots"]
