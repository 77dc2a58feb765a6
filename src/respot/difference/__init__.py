"""What changed between two states of a robot's programs, as a reviewer asks before a download.

It shares the reading of programs with the rest of respot and nothing with what writes them: it is the independent
witness of every conversion.
"""

from respot.difference.comparison import Comparison, compare
from respot.difference.findings import RobotDifference
from respot.difference.positions import Tolerance

__all__ = ["Comparison", "RobotDifference", "Tolerance", "compare"]
