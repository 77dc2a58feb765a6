"""What a person may decide about a correction."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from respot.kinematics.model import RobotModel

#: `--max-shift`, mm and degrees (DESIGN section 10): of a theory calibration, and of a measured one. The way back of
#: either is as long as the way there.
THEORY_MAX_SHIFT, MEASURED_MAX_SHIFT = (150.0, 5.0), (10.0, 1.0)
#: `--max-residual` [mm].
MAX_RESIDUAL = 15.0


@dataclass(frozen=True)
class CorrectionOptions:
    """Options of `convert`.

    Parameters
    ----------
    programs : str, optional
        Glob of program names that are in scope, in place of what the matched spots say.
    max_shift : (float, float or None), optional
        A target moves no further than this, mm and degrees; by default as far as is usual for the calibration's kind.
    keep_config : bool
        Keep status/turn and confdata of moved targets where they cannot be computed.
    partial : bool
        Correct what can be corrected of a program with refused targets.
    templates : Path, optional
        A plant's own templates.
    robot : RobotModel, optional
        Kinematic model in place of the machine data's.
    inverse : bool
        The other way round.
    bases : str
        ``kept`` or ``remeasured``: whether a rigid motion of all points under a base is left out of them.
    max_residual : float
        No target departs from the rigid motion of its path by more [mm].
    any_source : bool
        Use a calibration on another robot or another state of the backup than it was fitted to.
    covariates : Path, optional
        Table of columns that effects follow.
    apply : str, optional
        ``points`` or ``frames``: whether the errors of whole bases and tools go into their data. None is ``points``
        where the choice does not matter to what is right.
    snap : bool
        Put each weld exactly onto its theoretical position, and blend the path between.
    """

    programs: str | None = None
    max_shift: tuple[float, float | None] | None = None
    keep_config: bool = False
    partial: bool = False
    templates: Path | None = None
    robot: RobotModel | None = None
    inverse: bool = False
    bases: Literal["kept", "remeasured"] = "kept"
    max_residual: float = MAX_RESIDUAL
    any_source: bool = False
    covariates: Path | None = None
    apply: Literal["points", "frames"] | None = None
    snap: bool = False

    def furthest(self, kind: str) -> tuple[float, float]:
        """Limits of a shift, mm and degrees, for a calibration of a kind."""
        usual = THEORY_MAX_SHIFT if kind == "theory" else MEASURED_MAX_SHIFT
        if self.max_shift is None:
            return usual
        return self.max_shift[0], usual[1] if self.max_shift[1] is None else self.max_shift[1]
