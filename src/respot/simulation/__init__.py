"""Lines with hidden effects, to try the engine on. Imports nothing of it: the two cannot agree by construction."""

from respot.simulation.backup import backup_files, files_of
from respot.simulation.effects import EFFECTS, OUTSIDE
from respot.simulation.line import LAYOUTS, Line, simulate
from respot.simulation.plant import LEAST_ROBOTS, plant_files
from respot.simulation.rerun import Landing, rerun
from respot.simulation.robots import ROBOTS

__all__ = [
    "EFFECTS",
    "LAYOUTS",
    "LEAST_ROBOTS",
    "OUTSIDE",
    "ROBOTS",
    "Landing",
    "Line",
    "backup_files",
    "files_of",
    "plant_files",
    "rerun",
    "simulate",
]
