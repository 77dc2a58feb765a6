"""What a person may decide about a correction."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from respot.kinematics.model import RobotModel

#: `--max-shift` of align, mm and degrees (DESIGN section 10).
ALIGN_MAX_SHIFT = (150.0, 5.0)


@dataclass(frozen=True)
class CorrectionOptions:
    """Options of `convert`.

    Parameters
    ----------
    programs : str, optional
        Glob of program names that are in scope, in place of what the matched spots say.
    max_shift : (float, float)
        A target moves no further than this, mm and degrees.
    keep_config : bool
        Keep status/turn and confdata of moved targets where they cannot be computed.
    partial : bool
        Correct what can be corrected of a program with refused targets.
    templates : Path, optional
        A plant's own templates.
    robot : RobotModel, optional
        Kinematic model in place of the machine data's.
    """

    programs: str | None = None
    max_shift: tuple[float, float] = ALIGN_MAX_SHIFT
    keep_config: bool = False
    partial: bool = False
    templates: Path | None = None
    robot: RobotModel | None = None
