"""Made-up backups of a robot with hundreds of welding programs that it can run, and lists of their spots.

Main calls styles, styles call programs of 100 targets each: of five motions one goes to a spot, the others come from
an approach point and lead past the clamps; some are shifts along base or tool. All targets are within reach and limits
and carry the status and turn, or confdata, of the joints they were made from.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial.transform import RigidTransform, Rotation

from respot.geometry import Array, abc_from_rotation, pose, quaternion_from_rotation, rotation_from_abc
from respot.kinematics.cell import RobotCell
from respot.kinematics.configuration import configuration_of
from respot.kinematics.opw import OpwRobot
from respot.kinematics.path import singularity_distances
from respot.kinematics.robots import built_in_robots
from respot.simulation.backup import backup_files
from respot.simulation.line import Line, simulate

ROBOTS = {"krl": "kr210_r2700_extra", "rapid": "irb6700_200_260"}
#: Bases that programs weld in, beside the one of the simulated line: X, Y, Z [mm], A, B, C [deg].
BASES = ((1420.0, -815.5, 310.25, 0.85, -0.32, 0.14), (1612.5, 420.0, 280.0, 90.4, 0.21, -0.1),
         (1180.0, 35.5, 505.75, -45.2, 0.4, 0.3), (1300.0, -1250.0, 610.0, 179.2, -0.5, 0.05))  # fmt: skip
TARGETS = 100
_SPOT_EVERY = 5
_STYLE = 30


@dataclass(frozen=True, eq=False)
class Welding:
    """What the programs of a backup do, n targets in their order.

    Parameters
    ----------
    language : str
    line : Line
        The simulated line whose robot, gun and files it has.
    model : OpwRobot
    joints : (n, 6) array
        [deg]
    world : RigidTransform
        TCP of n targets [mm].
    base : (n,) array of int
        Which of `BASES`.
    configuration : (n, k) array of int
        Status and turn, or confdata.
    """

    language: str
    line: Line
    model: OpwRobot
    joints: Array
    world: RigidTransform
    base: Array
    configuration: Array

    def __len__(self) -> int:
        return len(self.joints)

    @property
    def spots(self) -> Array:
        """Rows of the spots."""
        return np.arange(_SPOT_EVERY // 2, len(self), _SPOT_EVERY)

    @property
    def local(self) -> RigidTransform:
        """The targets in their bases [mm]."""
        bases = np.array(BASES)[self.base]
        return pose(bases[:, :3], rotation_from_abc(bases[:, 3:])).inv() * self.world


def name_of(row: int) -> str:
    """ID of a spot."""
    return f"P02WP{1600000 + row}"


def draw(language: str, programs: int, seed: int = 1) -> Welding:
    """Draw the targets of so many programs."""
    line = simulate(ROBOTS[language], 8, seed=seed)
    limits = np.array(line.robot["limits_deg"])
    model = built_in_robots()[ROBOTS[language]].model.with_limits(limits)
    dice = np.random.default_rng(seed)
    joints = np.concatenate([_way(model, line, dice) for _ in range(programs)])
    tool2flange = RigidTransform.from_matrix(line.flange2tool)
    world = model.forward(joints) * tool2flange
    base = np.repeat(dice.integers(0, len(BASES), programs), TARGETS)
    configuration = configuration_of(RobotCell(model, language), joints)
    return Welding(language, line, model, joints, world, base, configuration)


def _way(model: OpwRobot, line: Line, dice: np.random.Generator) -> Array:
    """Joints (100, 6) of a program: a walk about the attitude of a spot of the simulated line."""
    start = line.joints[dice.integers(line.n)]
    limits = np.asarray(model.limits_deg)
    found = np.empty((0, 6))
    while len(found) < TARGETS:
        tried = start + dice.uniform(-12.0, 12.0, (TARGETS, 6))
        inside = (np.minimum(tried - limits[:, 0], limits[:, 1] - tried) > 6.0).all(axis=1)
        clear = (np.abs(tried[:, 3:]) < 172.0).all(axis=1) & (np.abs(tried[:, 4]) > 12.0)
        distances = singularity_distances(model, tried)
        found = np.concatenate([found, tried[inside & clear & (distances > [120.0, 8.0, 8.0]).all(axis=1)]])
    return found[:TARGETS]


def write(welding: Welding, folder: Path) -> None:
    """Write the backup."""
    made = _krl if welding.language == "krl" else _rapid
    files = {path: data for path, data in backup_files(welding.line).items() if "spots" not in path.lower()}
    for path, text in made(welding, {path: data.decode("cp1252") for path, data in files.items()}):
        place = folder / path
        place.parent.mkdir(parents=True, exist_ok=True)
        place.write_bytes(text.replace("\r\n", "\n").replace("\n", "\r\n").encode("cp1252"))


def theory(welding: Welding, count: int, seed: int = 2) -> str:
    """Return a table of some spots where they should be: a few millimetres from where they are, as one body."""
    dice = np.random.default_rng(seed)
    rows = np.sort(dice.choice(welding.spots, min(count, len(welding.spots)), replace=False))
    turn = Rotation.from_euler("ZYX", (0.21, -0.13, 0.08), degrees=True)
    return _table(rows, turn.apply(welding.world[rows].translation) + (4.2, -3.1, 2.6), dice, 0.3)


def measured(welding: Welding, count: int, seed: int = 3) -> str:
    """Return a table of some spots where a tracker saw them: axes 2 and 3 are mastered wrong."""
    dice = np.random.default_rng(seed)
    rows = np.sort(dice.choice(welding.spots, min(count, len(welding.spots)), replace=False))
    joints = welding.joints[rows] + (0.0, 0.06, -0.05, 0.0, 0.0, 0.0)
    real = (welding.model.forward(joints) * RigidTransform.from_matrix(welding.line.flange2tool)).translation
    turn = Rotation.from_euler("ZYX", (37.0, 1.2, -0.7), degrees=True)
    return _table(rows, turn.apply(real) + (2100.0, -3300.0, 120.0), dice, 0.05)


def _table(rows: Array, points: Array, dice: np.random.Generator, noise: float) -> str:
    seen = points + dice.normal(0.0, noise, points.shape)
    lines = [f"{name_of(row)},{x:.4f},{y:.4f},{z:.4f}" for row, (x, y, z) in zip(rows, seen, strict=True)]
    return "\n".join(["id,x,y,z", *lines, ""])


def _programs(welding: Welding) -> Iterator[tuple[str, range]]:
    """Name and rows of each program."""
    for number in range(len(welding) // TARGETS):
        yield f"Weld{number:04d}", range(number * TARGETS, (number + 1) * TARGETS)


def _styles(welding: Welding) -> dict[str, list[str]]:
    """Programs that each style calls."""
    names = [name for name, _ in _programs(welding)]
    return {f"Style{n // _STYLE:02d}": names[n : n + _STYLE] for n in range(0, len(names), _STYLE)}


def _krl(welding: Welding, files: dict[str, str]) -> Iterator[tuple[str, str]]:
    styles = _styles(welding)
    cell, config = "KRC/R1/cell.src", "KRC/R1/System/$config.dat"
    for number, base in enumerate(BASES[1:], start=2):
        old = f"BASE_DATA[{number}]={{X 0.0,Y 0.0,Z 0.0,A 0.0,B 0.0,C 0.0}}"
        new = ",".join(f"{name} {value}" for name, value in zip("XYZABC", base, strict=True))
        assert old in files[config]
        files[config] = files[config].replace(old, f"BASE_DATA[{number}]={{{new}}}")
    cases = [f"    CASE {n}\n      {style} ( )" for n, style in enumerate(styles, start=1)]
    files[cell] = f"DEF CELL ( )\n  SWITCH PGNO\n{chr(10).join(cases)}\n  ENDSWITCH\nEND\n"
    yield from files.items()
    for style, names in styles.items():
        calls = "\n".join(f"  {name} ( )" for name in names)
        yield f"KRC/R1/Program/{style}.src", f"&ACCESS RVP\nDEF {style} ( )\n{calls}\nEND\n"
    values = np.hstack([welding.local.translation, abc_from_rotation(welding.local.rotation)])
    for name, rows in _programs(welding):
        code, data = [f"&ACCESS RVP\n&REL 12\nDEF {name} ( )"], [f"&ACCESS RVP\n&REL 12\nDEFDAT {name}"]
        number = int(welding.base[rows[0]]) + 1
        code.append(f";set tool and base\n$TOOL=TOOL_DATA[1]\n$BASE=BASE_DATA[{number}]\nBAS(#VEL_CP,0.5)")
        for place, row in enumerate(rows):
            point = _krl_point(welding, code, place, row)
            shown = ",".join(f"{letter} {value:.6f}" for letter, value in zip("XYZABC", values[row], strict=True))
            status, turn = welding.configuration[row]
            tail = f"S {status},T {turn},E1 0.0,E2 0.0,E3 0.0,E4 0.0,E5 0.0,E6 0.0"
            data.append(f"DECL E6POS X{point}={{{shown},{tail}}}")
            if point.startswith("P02"):
                data.append(
                    f'DECL FDAT F{point}={{TOOL_NO 1,BASE_NO {number},IPO_FRAME #BASE,POINT2[] " ",TQ_STATE FALSE}}\n'
                    f"DECL LDAT LCPDAT{place}={{VEL 2.0,ACC 100.0,APO_DIST 20.0,APO_FAC 50.0,ORI_TYP #VAR}}\n"
                    f"DECL SPOT_TYPE SDAT{place}={{GUN 1,PAIR #FIRST,RETR #OPN,CLO_TM 0,PGNO1 12,PRESS1 2.5}}"
                )
        yield f"KRC/R1/Program/{name}.src", "\n".join([*code, "END", ""])
        yield f"KRC/R1/Program/{name}.dat", "\n".join([*data, "ENDDAT", ""])


def _krl_point(welding: Welding, code: list[str], place: int, row: int) -> str:
    """Add the motion to a target; return the target's name."""
    if place % _SPOT_EVERY == _SPOT_EVERY // 2:
        number, point = int(welding.base[row]) + 1, name_of(row)
        code.append(
            f";FOLD SPOT LIN {point} Vel=0.5 m/s CPDAT{place} SDAT{place} Gun=1 Pair=FIRST Retr=OPN Prog=12 "
            f"Tool[1]:GUN Base[{number}]:PART;%{{PE}}%R 4.0.4,%MKUKATPSPOT,%CSPOT,%VLIN,%P 1:LIN, 2:{point}, 3:, "
            f"5:0.5, 7:CPDAT{place}, 9:SDAT{place}\n$BWDSTART=FALSE\nLDAT_ACT=LCPDAT{place}\nFDAT_ACT=F{point}\nS_ACT=SDAT{place}\n"
            f"USERSPOT(#ADVSPOT,S_ACT)\nBAS(#CP_PARAMS,0.5)\nLIN X{point}\nUSERSPOT(#SPOT,S_ACT)\n;ENDFOLD"
        )
        code.append(
            f"; clamp {place} of the fixture\nIF ($IN[{place + 100}]==FALSE) AND (COUNT<{place}) THEN\n"
            f"  $OUT[{place + 300}]=TRUE\n  COUNT=COUNT+1\nENDIF\nWAIT FOR $IN[{place + 200}] AND NOT $IN[{place + 300}]"
        )
        return point
    point = f"P{place}"
    code.append(f"{'PTP' if place % _SPOT_EVERY == 0 else 'LIN'} X{point} C_DIS")
    if place % 20 == 4:
        code.append("LIN_REL {Z -25.0} C_DIS\nWAIT FOR $IN[12]")
    elif place % 20 == 14:
        code.append("LIN_REL {X 0.0,Y 0.0,Z -30.0,A 0.0,B 0.0,C 0.0} #TOOL\n$OUT[7]=TRUE")
    return point


def _rapid(welding: Welding, files: dict[str, str]) -> Iterator[tuple[str, str]]:
    folder, styles = "RAPID/TASK1/PROGMOD", _styles(welding)
    data = "RAPID/TASK1/SYSMOD/WeldData.sys"
    frames = [
        f'  PERS wobjdata wobj{number}:=[FALSE,TRUE,"",[{_rapid_pose(np.array(base[:3]), rotation_from_abc(base[3:]))}],'
        "[[0,0,0],[1,0,0,0]]];"
        for number, base in enumerate(BASES)
    ]
    files[data] = files[data].replace(
        "ENDMODULE", "\n".join([*frames, "  PERS spotdata sdWeld:=[12,2500,1.6,0];", "ENDMODULE"])
    )
    calls = "\n".join(f"    CASE {n}:\n      r{style};" for n, style in enumerate(styles, start=1))
    files[f"{folder}/MainModule.mod"] = (
        f"MODULE MainModule\n  PROC main()\n    ConfL\\On;\n    TEST giProgNo\n{calls}\n    ENDTEST\n  ENDPROC\nENDMODULE\n"
    )
    yield from files.items()
    for style, names in styles.items():
        inner = "\n".join(f"    r{name};" for name in names)
        yield f"{folder}/{style}.mod", f"MODULE {style}\n  PROC r{style}()\n{inner}\n  ENDPROC\nENDMODULE\n"
    local, quaternions = welding.local.translation, quaternion_from_rotation(welding.local.rotation)
    for name, rows in _programs(welding):
        points, code = [f"MODULE {name}"], [f"\n  PROC r{name}()"]
        for place, row in enumerate(rows):
            point = _rapid_point(code, place, row, f"wobj{welding.base[row]}")
            at = ",".join(f"{value:.6f}" for value in local[row])
            turn = ",".join(f"{value:.9f}" for value in quaternions[row])
            conf = ",".join(map(str, welding.configuration[row]))
            scope = "" if point.startswith("P02") else "LOCAL "
            points.append(
                f"  {scope}CONST robtarget {point}:=[[{at}],[{turn}],[{conf}],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];"
            )
        yield f"{folder}/{name}.mod", "\n".join([*points, *code, "  ENDPROC", "ENDMODULE", ""])


def _rapid_point(code: list[str], place: int, row: int, wobj: str) -> str:
    """Add the motion to a target; return the target's name."""
    frames = f"tWeldGun1\\WObj:={wobj}"
    if place % _SPOT_EVERY == _SPOT_EVERY // 2:
        point = name_of(row)
        code.append(
            f"    !{point}\n    SpotL {point},v800,gun1,sdWeld,{frames};\n    SetDO doWeld{place},1;\n"
            f"    ! clamp {place} of the fixture\n    IF diClamp{place}=0 AND nCount<{place} THEN\n"
            f'      SetDO doClamp{place},1;\n      nCount:=nCount+1;\n      TPWrite "clamp "\\Num:={place};\n'
            f"    ENDIF\n    WaitDI diClamp{place},1\\MaxTime:=0.5;\n    WaitUntil diClosed{place}=1 OR bDry;"
        )
        return point
    point = f"p{place}0"
    if place % 20 == 4:
        code.append(f"    MoveL Offs({point},0,0,-25),v500,z10,{frames};\n    WaitDI diClamp,1;")
    elif place % 20 == 14:
        code.append(f"    MoveL RelTool({point},0,0,-30),v500,z10,{frames};\n    Set doClamp;")
    code.append(f"    Move{'J' if place % _SPOT_EVERY == 0 else 'L'} {point},v1500,z10,{frames};")
    return point


def _rapid_pose(at: Array, turn: Rotation) -> str:
    place = ",".join(f"{value:.6f}" for value in at)
    return f"[{place}],[{','.join(f'{value:.9f}' for value in turn.as_quat(scalar_first=True))}]"
