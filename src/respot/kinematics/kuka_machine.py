"""A KUKA robot from its ``$machine.dat``: lengths, limits, place (facts: krl.md section 7).

No list of robots is needed.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from scipy.spatial.transform import RigidTransform

from respot.geometry import Array, distance_mm, pose, rotation_from_abc, turn_deg
from respot.kinematics.cell import Reason, RobotCell
from respot.kinematics.model import RobotModel
from respot.kinematics.opw import OpwRobot
from respot.kinematics.track import Track
from respot.program.robot import Machine

Values = Mapping[str, object]

#: What a standard six-axis arm with a central hand says of itself; any other value is another kind of arm.
STANDARD: dict[str, object] = {
    "$KINCLASS": "#STANDARD",
    "$MAIN_AXIS": "#NR",
    "$WRIST_AXIS": "#ZEH",
    "$TRAFO_AXIS": 6.0,
    "$A4PAR": 0.0,
    "$SPINDLE": 0.0,
    "$DEF_A4FIX": "FALSE",
    "$DEF_A5LINK": "FALSE",
    **{f"$AXIS_SEQ[{n}]": float(n) for n in range(1, 7)},
    **{f"$AXIS_DIR[{n}]": sign for n, sign in enumerate((-1.0, 1.0, 1.0, -1.0, -1.0, -1.0), start=1)},
    **{f"$AXIS_TYPE[{n}]": 3.0 for n in (1, 2, 3, 5)},
}
#: Rotation and offsets that the frames of such an arm have; the other components are its lengths.
FRAMES: dict[str, dict[str, float]] = {
    "$TIRORO": {"X": 0.0, "Y": 0.0, "A": 0.0, "B": 0.0, "C": 0.0},
    "$TFLWP": {"X": 0.0, "Y": 0.0, "A": 0.0, "B": 0.0, "C": 0.0},
    "$TX3P3": {"Y": 0.0, "A": 0.0, "B": 90.0, "C": 0.0},
    "$DH_4": {"DHART_A": 0.0, "DHART_D": 0.0, "DHART_ALPHA": 90.0},
    "$DH_5": {"DHART_A": 0.0, "DHART_D": 0.0, "DHART_ALPHA": -90.0},
}
SIGNS = (-1, 1, 1, -1, 1, -1)
#: External axes as $ETn_AX names them.
_EXTERNAL = tuple(f"#E{n}" for n in range(1, 7))
OFFSETS = (0.0, -90.0, 0.0, 0.0, 0.0, 0.0)
#: Axes whose motor no other axis turns: the shafts of axes 5 and 6 run through the hand.
_OWN_MOTOR = 4


def kuka_cell(machine: Machine, robot: RobotModel | None = None) -> RobotCell | Reason:
    """Cell of a KUKA robot, or why its machine data do not make one; ``robot`` replaces their lengths."""
    values = machine.values
    model = robot or _model(machine.model, values)
    if isinstance(model, Reason):
        return model
    if "$ROBROOT" in values:
        robroot = frame(values, "$ROBROOT")
        if robroot is None:
            return _no("$ROBROOT does not hold six numbers")
    else:
        robroot = RigidTransform.identity()
    limits, notes = _limits(values)
    if limits is not None and model.limits_deg is None and model.axes == len(limits):
        try:
            model = model.with_limits(limits)
        except ValueError as error:
            return _no(f"software limits: {error}")
    if "$ROBROOT" not in values:
        notes.append("$ROBROOT is not in the machine data: the robot is taken to stand in the world's origin")
    track = _track(values, robroot)
    if isinstance(track, Reason):
        notes.append(f"the robot stands on an external axis ($EX_KIN, #ERSYS), its base moves: {track}")
    elif track is not None:
        notes.append(f"the robot stands on an external axis, {track.name}, as $ERSYSROOT and $ET1_.. say")
    count = values.get("$EX_AX_NUM", 0.0)
    accurate = str(values.get("$ABS_ACCUR", "")).upper() in ("#ACTIVE", "TRUE")
    return RobotCell(
        model=model,
        language="krl",
        robroot=robroot if not isinstance(track, Track) else track.base2world(np.zeros(6)),
        absolute_accuracy=accurate,
        on_track=track is not None,
        track=track if isinstance(track, Track) else None,
        external_axes=int(count) if isinstance(count, float) else 0,
        motor_turns=_motor_turns(values, model.axes),
        notes=tuple(notes),
    )


def _model(name: str, values: Values) -> OpwRobot | Reason:
    if not any(key in values for key in ("$LENGTH_A", "$LENGTH_B", "$TX3P3")):
        return _no("the backup holds no machine data ($machine.dat) with lengths")
    for key, expected in STANDARD.items():
        found = values.get(key)
        if found is not None and (found.upper() if isinstance(found, str) else found) != expected:
            return _no(f"{key} is {_shown(found)}, a standard arm has {_shown(expected)}: no model of this kind of arm")
    for key, fixed in FRAMES.items():
        members = values.get(key)
        if members is None and key.startswith("$DH"):
            continue
        for member, expected_number in fixed.items():
            number = _number(members, member)
            if number is None or abs(number - expected_number) > 1e-6:
                shown = "missing" if number is None else f"{number:g}"
                return _no(f"{member} of {key} is {shown}, a standard arm has {expected_number:g}")
    return _from_lengths(name, values)


def _from_lengths(name: str, values: Values) -> OpwRobot | Reason:
    lengths = {
        "c1": _number(values.get("$TIRORO"), "Z"),
        "a1": _plain(values.get("$LENGTH_A")),
        "c2": _plain(values.get("$LENGTH_B")),
        "c3": _number(values.get("$TX3P3"), "X"),
        "a2": _number(values.get("$TX3P3"), "Z"),
        "c4": _number(values.get("$TFLWP"), "Z"),
    }
    known = {key: value for key, value in lengths.items() if value is not None}
    if len(known) < len(lengths):
        return _no("$TIRORO, $LENGTH_A, $LENGTH_B, $TX3P3 or $TFLWP is missing or no number")
    known["a2"] = -known["a2"]
    try:
        return OpwRobot(name=name, source="$machine.dat", **known, signs=SIGNS, offsets_deg=OFFSETS)  # type: ignore[arg-type]
    except ValueError as error:
        return _no(str(error))


def _limits(values: Values) -> tuple[Array | None, list[str]]:
    pairs = [[_plain(values.get(f"$SOFT{end}_END[{n}]")) for end in "NP"] for n in range(1, 7)]
    if all(bound is None for pair in pairs for bound in pair):
        return None, ["software limits unknown, not checked"]
    notes = [f"software limit of axis {n} unknown" for n, pair in enumerate(pairs, 1) if None in pair]
    open_bounds = [[-np.inf if low is None else low, np.inf if high is None else high] for low, high in pairs]
    limits = np.array(open_bounds, dtype=float)
    endless = [n for n in range(1, 7) if values.get(f"$AXIS_TYPE[{n}]") == 5.0]
    limits[[n - 1 for n in endless]] = -np.inf, np.inf
    return limits, notes


def _motor_turns(values: Values, axes: int) -> Array | None:
    """Turns of the motor for one of each axis, (axes,), from ``$RAT_MOT_AX[n]={N numerator,D denominator}``."""
    turns = np.full(axes, np.nan)
    for axis in range(min(axes, _OWN_MOTOR)):
        ratio = values.get(f"$RAT_MOT_AX[{axis + 1}]")
        above, below = _number(ratio, "N"), _number(ratio, "D")
        if above and below:
            turns[axis] = abs(above / below)
    return turns if np.isfinite(turns).any() else None


def _track(values: Values, robroot: RigidTransform) -> Track | Reason | None:
    """What carries the robot: the member of $EX_KIN that is #ERSYS, with one axis; None where nothing does.

    The chain is $ERSYSROOT, $ETn_TA1KR, the axis along or about its z, $ETn_TA2A1, $ETn_TA3A2, $ETn_TFLA3.
    """
    kinematics = values.get("$EX_KIN")
    members = kinematics if isinstance(kinematics, Mapping) else {}
    carriers = [str(name).upper() for name, kind in members.items() if str(kind).upper() == "#ERSYS"]
    if not carriers:
        return None
    chain = carriers[0]
    axes = values.get(f"${chain}_AX")
    driven = [str(axis).upper() for axis in axes.values()] if isinstance(axes, Mapping) else []
    driven = [axis for axis in driven if axis != "#NONE"]
    if len(carriers) > 1 or len(driven) != 1 or driven[0] not in _EXTERNAL:
        return _no(f"${chain}_AX does not name one axis, or several kinematics carry the robot")
    number = _EXTERNAL.index(driven[0])
    kind = _plain(values.get(f"$AXIS_TYPE[{number + 7}]"))
    keys = ("$ERSYSROOT", *(f"${chain}_{part}" for part in ("TA1KR", "TA2A1", "TA3A2", "TFLA3")))
    found = [frame(values, key) for key in keys]
    frames = [pose for pose in found if pose is not None]
    if len(frames) < len(keys) or kind not in (1.0, 3.0, 5.0):
        return _no(f"{', '.join(keys)} or $AXIS_TYPE[{number + 7}] is missing or does not hold what it should")
    root, foot, *rest = frames
    carriage = rest[0] * rest[1] * rest[2]
    track = Track(number, root * foot, carriage=carriage, turns=kind != 1.0, name=f"E{number + 1}")
    # with $ROBROOT of its own the machine data can be read in two ways, and nothing tells which
    rest_pose = track.base2world(np.zeros(number + 1))
    if not any(_same(robroot, known) for known in (RigidTransform.identity(), rest_pose)):
        return _no("$ROBROOT is neither zero nor the place of the robot at zero")
    return track


def _same(first: RigidTransform, second: RigidTransform) -> bool:
    return float(distance_mm(first, second)) < 1e-3 and float(turn_deg(first, second)) < 1e-4


def frame(values: Values, key: str) -> RigidTransform | None:
    """Pose of a FRAME of the machine data; None unless it holds six numbers."""
    numbers = [number for name in "XYZABC" if (number := _number(values.get(key), name)) is not None]
    return pose(numbers[:3], rotation_from_abc(numbers[3:])) if len(numbers) == 6 else None


def _number(members: object, name: str) -> float | None:
    return _plain(members.get(name)) if isinstance(members, Mapping) else None


def _plain(value: object) -> float | None:
    return float(value) if isinstance(value, int | float) and np.isfinite(value) else None


def _shown(value: object) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value)


def _no(message: str) -> Reason:
    return Reason("CONFIG_NOT_CHECKED", message)
