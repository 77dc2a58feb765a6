"""The three choices that tell the branches of a spherical-wrist robot apart, with their distance from the border.

Both makers count the same three: is the wrist centre in front of axis 1, to which side of the lower arm is it, what
is the sign of axis 5 (facts: krl.md section 5, status; rapid.md 2.2, cfx).
"""

from __future__ import annotations

import numpy as np

from respot.geometry import Array
from respot.kinematics.opw import OpwRobot

#: Columns of `posture`.
FRONT, ELBOW, WRIST = 0, 1, 2


def posture(model: OpwRobot, joints: Array) -> Array:
    """Signed distances from the three borders, shape (..., 3) for joints (..., 6) [deg].

    Column 0: the wrist centre's x in the frame that turns with axis 1 [mm]: negative is behind axis 1, "overhead".
    Column 1: angle of axis 3 above the stretched arm [deg] in (-180, 180], the arm being stretched where the wrist
    centre lies on the line from axis 2 to axis 3: negative is behind the lower arm. Column 2: axis 5 [deg].
    """
    theta = np.radians(joints @ model.coupling.T - np.array(model.offsets_deg))
    upper, fore = theta[..., 1], theta[..., 1] + theta[..., 2]
    front = model.a1 + model.c2 * np.sin(upper) + model.c3 * np.sin(fore) + model.a2 * np.cos(fore)
    elbow = theta[..., 2] + np.arctan2(model.a2, model.c3)
    elbow = np.degrees(np.arctan2(np.sin(elbow), np.cos(elbow)))
    return np.stack([front, elbow, joints[..., 4]], axis=-1)
