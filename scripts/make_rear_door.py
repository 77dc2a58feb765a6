"""Write the robot programs of ``samples/rear_door`` from the actual weld coordinates in ``actual.csv``.

Input are the weld coordinates and the cell data beside them (tools, bases, robot root, limits: ``$config.dat``,
``$machine.dat``, ``WeldData.sys``, ``MOC.cfg``), which are written by hand; output are the programs with their points.

The script stands apart from respot on purpose: what it writes must not be able to agree with an error of respot.

    python scripts/make_rear_door.py            write the programs
    python scripts/make_rear_door.py --check    regenerate in memory; exit 1 if any byte on disk differs
"""

from __future__ import annotations

import argparse
import csv
import re
import sys
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from py_opw_kinematics import KinematicModel, Robot
from scipy.spatial.transform import RigidTransform, Rotation

Floats = NDArray[np.float64]
ROOT = Path(__file__).resolve().parent.parent / "samples" / "rear_door"
KUKA, ABB = "kuka/KRC/R1", "abb/RAPID/TASK1"
PREFIX = "P02WP"
#: Spot, then the taught gun attitude: yaw, pitch, roll in degrees about the row's nominal gun pose.
LOWER = [
    ("1615434", 18.74, -22.31, 9.12), ("1615435", 13.26, -21.58, 6.87), ("1615436", 8.05, -23.42, 5.34),
    ("1615437", 4.41, -24.17, 2.08), ("1615438", 1.19, -22.65, 0.92), ("1615429", -2.87, -21.94, -1.35),
    ("1615430", -8.33, -23.08, -3.21), ("1615431", -12.46, -21.27, -5.93), ("1615432", -17.92, -19.86, -8.74),
]  # fmt: skip
UPPER = [
    ("1615441", -15.23, 36.18, -7.64), ("1615439", -11.07, 34.25, -6.41), ("1609707", -7.38, 33.09, -4.86),
    ("1615442", 9.15, 32.74, 5.27), ("1609713", 13.82, 35.41, 7.33),
]  # fmt: skip


def pose(x: float, y: float, z: float, a: float = 0.0, b: float = 0.0, c: float = 0.0) -> RigidTransform:
    """Pose from KUKA X Y Z A B C: R = Rz(A) Ry(B) Rx(C)."""
    return RigidTransform.from_components([x, y, z], Rotation.from_euler("ZYX", [a, b, c], degrees=True))


def read(name: str) -> str:
    """Return the text of a hand-written file of the samples."""
    return (ROOT / name).read_bytes().decode("cp1252")


def find(pattern: str, text: str) -> str:
    """Return the first group of the first match."""
    found = re.search(pattern, text)
    if found is None:
        raise ValueError(f"not found: {pattern}")
    return found[1]


@dataclass
class Arm:
    """A robot on its place in the car frame, with its gun; remembers its last joints to stay on one branch."""

    robot: Robot
    limits: Floats
    root: RigidTransform
    tool: RigidTransform
    joints: Floats

    def solve(self, world: RigidTransform) -> Floats:
        """Return the joints [deg] that bring the TCP to `world`: inside the limits, A5 < 0, nearest to the last."""
        flange = self.root.inv() * world * self.tool.inv()
        found = self.robot.reach(flange, joint_limits=self.limits)
        usable = [
            q
            for q, margin in zip(found.joints[0], found.limit_margin[0], strict=True)
            if np.isfinite(margin) and margin > 3.0 and q[4] < -5.0
        ]
        if not usable:
            raise ValueError(f"not reachable: {world.translation}")
        self.joints = np.asarray(min(usable, key=lambda q: float(np.abs(q - self.joints).max())))
        edge = np.abs((self.joints[[0, 3, 5]] + 45.0) % 90.0 - 45.0).min()
        if edge < 0.05 or abs(self.joints[2]) < 0.05:
            raise ValueError(f"an axis stands on a multiple of 90 degrees: {self.joints}")
        return self.joints


@dataclass(frozen=True)
class Cell:
    """The taught poses of both rows in the car frame; `throat` is the tool axis that runs into the gun's throat."""

    spots: dict[str, RigidTransform]
    throat: tuple[float, float, float]

    def off(
        self, spot: str, back: float, shift: Sequence[float] = (0, 0, 0), turn: Sequence[float] = (0, 0, 0)
    ) -> RigidTransform:
        """Return a taught point `back` mm out of the throat of a spot's gun pose, moved and turned a little."""
        at = self.spots[PREFIX + spot]
        throat = at.rotation.apply(self.throat)
        turned = Rotation.from_euler("ZYX", turn, degrees=True) * at.rotation
        return RigidTransform.from_components(at.translation - back * throat + np.asarray(shift, float), turned)


def read_spots(gun: Floats) -> dict[str, RigidTransform]:
    """Weld poses: position from actual.csv, orientation from the tables above; `gun` holds the tool axes as columns."""
    with (ROOT / "actual.csv").open(encoding="ascii", newline="") as file:
        xyz = {row["id"]: [float(row[c]) for c in "xyz"] for row in csv.DictReader(file)}
    return {
        PREFIX + name: RigidTransform.from_components(
            xyz[PREFIX + name],
            Rotation.from_euler("ZYX", [yaw, pitch, roll], degrees=True) * Rotation.from_matrix(gun),
        )
        for name, yaw, pitch, roll in LOWER + UPPER
    }


# ---------------------------------------------------------------------------------------------------- KUKA

# Tool X closes the gun (sheet normal), tool Z runs into the throat (towards the front of the car).
KUKA_GUN = np.array([[0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]])


def real(value: float) -> str:
    """Print a REAL as the controller does: float32, six digits where they suffice, else nine."""
    single = np.float32(value)
    if single == 0:
        return "0.0"
    short = f"{single:#.6g}"
    return short if np.float32(short) == single else f"{single:#.9g}"


def coordinate(value: float) -> str:
    """Print a coordinate of a point: float32 with all its nine digits, so that base times point stays exact."""
    return f"{np.float32(value):#.9g}"


def krl_numbers(name: str, text: str) -> list[float]:
    """Numbers of an aggregate such as ``BASE_DATA[1]={X 1.0,Y 2.0}``."""
    return [float(part.split()[1]) for part in find(rf"(?m)^(?:\w+ )*{re.escape(name)}={{(.*?)}}", text).split(",")]


def krl_frame(name: str, text: str) -> RigidTransform:
    """Pose of a FRAME variable."""
    return pose(*krl_numbers(name, text))


def status_turn(joints: Floats) -> tuple[int, int]:
    """Status and Turn of a KR 210 R2700 extra, from its lengths."""
    a2, a3 = np.radians(joints[1]), np.radians(joints[2])
    wrist = 350 + 1150 * np.cos(a2) + 1200 * np.cos(a2 + a3) - 41 * np.sin(a2 + a3)
    status = int(wrist < 0) + 2 * int(a3 > -np.arctan2(41, 1200)) + 4 * int(joints[4] < 0)
    return status, sum(1 << i for i, q in enumerate(joints) if q < 0)


def text(value: str) -> str:
    """Quote a 24 character string as the inline forms keep it."""
    return f'"{value:<24}"'


@dataclass
class Krl:
    """One KRL module: inline forms go to `src`, their data to `dat`."""

    name: str
    arm: Arm
    tool: int = 1
    base: int = 1
    rel: int = 37
    src: list[str] = field(default_factory=list)
    dat: list[str] = field(default_factory=list)
    taught: set[str] = field(default_factory=set)
    count: int = 0
    spots: int = 0

    def teach(self, name: str, world: RigidTransform, e1: float) -> None:
        """Put a point and its FDAT into the .dat; Status and Turn follow from the printed numbers."""
        if name in self.taught:
            return
        self.taught.add(name)
        local = self.frame().inv() * world
        shown = [coordinate(v) for v in local.translation]
        shown += [real(v) for v in local.rotation.as_euler("ZYX", degrees=True)]
        printed = self.frame() * pose(*[float(s) for s in shown])
        status, turn = status_turn(self.arm.solve(printed))
        numbers = ",".join(f"{n} {s}" for n, s in zip("XYZABC", shown, strict=True))
        self.dat += [
            f"DECL E6POS X{name}={{{numbers},S {status},T {turn},E1 {real(e1)},E2 0.0,E3 0.0,E4 0.0,E5 0.0,E6 0.0}}",
            f"DECL FDAT F{name}={{TOOL_NO {self.tool},BASE_NO {self.base},IPO_FRAME #BASE,"
            'POINT2[] " ",TQ_STATE FALSE}',
        ]

    def frame(self) -> RigidTransform:
        """Return the base, from $config.dat."""
        return krl_frame(f"BASE_DATA[{self.base}]", read(f"{KUKA}/System/$config.dat"))

    def frames(self) -> str:
        """Name tool and base as a fold title does."""
        config = read(f"{KUKA}/System/$config.dat")
        tool, base = (find(rf'{k}_NAME\[{n},\]="(.*?)"', config) for k, n in (("TOOL", self.tool), ("BASE", self.base)))
        return f"Tool[{self.tool}]:{tool} Base[{self.base}]:{base}"

    def move(self, kind: str, name: str, world: RigidTransform, e1: float, vel: str, cont: bool = False) -> None:
        """Add a PTP or LIN inline form of the basic package."""
        self.teach(name, world, e1)
        self.count += 1
        ptp = kind == "PTP"
        data = f"{'' if ptp else 'C'}PDAT{self.count}"
        blend = ("C_DIS" if ptp else "C_DIS C_DIS") if cont else ""
        title = f"{kind} {name}{' CONT' if cont else ''} Vel={vel} {'%' if ptp else 'm/s'} {data} {self.frames()}"
        self.dat.append(self.motion_data(ptp, data))
        self.src += [
            f";FOLD {title};%{{PE}}%R 8.3.29,%MKUKATPBASIS,%CMOVE,%V{kind},"
            f"%P 1:{kind}, 2:{name}, 3:{blend}, 5:{vel}, 7:{data}",
            "$BWDSTART=FALSE",
            f"{'P' if ptp else 'L'}DAT_ACT={'P' if ptp else 'L'}{data}",
            f"FDAT_ACT=F{name}",
            f"BAS(#{'PTP' if ptp else 'CP'}_PARAMS,{vel})",
            f"{kind} X{name} {blend}",
            ";ENDFOLD",
        ]

    def spot(
        self, name: str, world: RigidTransform, program: int, force: float, vel: str = "0.5", kind: str = "LIN"
    ) -> None:
        """Add a SpotTech inline form: move, then weld."""
        self.teach(name, world, 18.0)
        self.count += 1
        self.spots += 1
        ptp = kind == "PTP"
        data, weld = f"{'' if ptp else 'C'}PDAT{self.count}", f"SDAT{self.spots}"
        self.dat += [
            self.motion_data(ptp, data),
            f"DECL SPOT_TYPE {weld}={{GUN 1,PAIR #FIRST,RETR #OPN,CLO_TM 0,PGNO1 {program},PRESS1 {real(force)},"
            "PGNO2 0,PRESS2 0.0}",
        ]
        weld_title = f"{weld} Gun=1 Pair=FIRST Retr=OPN Prog={program}"
        title = f"SPOT {kind} {name} Vel={vel} {'%' if ptp else 'm/s'} {data} {weld_title} {self.frames()}"
        self.src += [
            f";FOLD {title};%{{PE}}%R 4.0.4,%MKUKATPSPOT,%CSPOT,%V{kind},"
            f"%P 1:{kind}, 2:{name}, 3:, 5:{vel}, 7:{data}, 9:{weld}",
            "$BWDSTART=FALSE",
            f"{'P' if ptp else 'L'}DAT_ACT={'P' if ptp else 'L'}{data}",
            f"FDAT_ACT=F{name}",
            f"S_ACT={weld}",
            "USERSPOT(#ADVSPOT,S_ACT)",
            f"BAS(#{'PTP' if ptp else 'CP'}_PARAMS,{vel})",
            f"{kind} X{name}",
            "USERSPOT(#SPOT,S_ACT)",
            ";ENDFOLD",
        ]

    @staticmethod
    def motion_data(ptp: bool, name: str) -> str:
        """Declare the PDAT or LDAT of one motion."""
        if ptp:
            return (
                f"DECL PDAT P{name}={{VEL 100.000,ACC 100.000,APO_DIST 50.0000,APO_MODE #CDIS,"
                "GEAR_JERK 50.0000,EXAX_IGN 0}"
            )
        return (
            f"DECL LDAT L{name}={{VEL 2.00000,ACC 100.000,APO_DIST 20.0000,APO_FAC 50.0000,AXIS_VEL 100.000,"
            "AXIS_ACC 100.000,ORI_TYP #VAR,CIRC_TYP #BASE,JERK_FAC 50.0000,GEAR_JERK 50.0000,EXAX_IGN 0}"
        )

    def home(self) -> None:
        """Add the home form; home is a joint position in $config.dat."""
        self.src += [
            ";FOLD PTP HOME Vel=100 % DEFAULT;%{PE}%R 8.3.29,%MKUKATPBASIS,%CMOVE,%VPTP,"
            "%P 1:PTP, 2:HOME, 3:, 5:100, 7:DEFAULT",
            "$BWDSTART=FALSE",
            "PDAT_ACT=PDEFAULT",
            "FDAT_ACT=FHOME",
            "BAS(#PTP_PARAMS,100)",
            "$H_POS=XHOME",
            "PTP XHOME ",
            ";ENDFOLD",
        ]

    def wait_in(self, number: int, label: str) -> None:
        """Add a WAIT FOR input form."""
        self.src += [
            f";FOLD WAIT FOR ( IN {number} '{label}' );%{{PE}}%R 8.3.29,%MKUKATPBASIS,%CEXT_WAIT_FOR,%VEXT_WAIT_FOR,"
            f"%P 2:, 4:, 5:$IN, 6:{number}, 7:{label}, 9:",
            f"WAIT FOR ( $IN[{number}] )",
            ";ENDFOLD",
        ]

    def output(self, number: int, label: str, state: bool, pulse: str = "") -> None:
        """Add an OUT or PULSE form."""
        value = str(state).upper()
        command, tail = ("PULSE", f" Time={pulse} sec") if pulse else ("OUT", "")
        code = f"PULSE($OUT[{number}],{value},{pulse})" if pulse else f"$OUT[{number}]={value}"
        self.src += [
            f";FOLD {command} {number} '{label}' State={value}{tail};%{{PE}}%R 8.3.29,%MKUKATPBASIS,%COUT,%V{command}X,"
            f"%P 2:{number}, 3:{label}, 5:{value}, 6:{pulse}",
            code,
            ";ENDFOLD",
        ]

    def begin(self, comment: str, *parameters: str) -> None:
        """Open a routine with its head comment."""
        self.src += [f"DEF {self.name}( )", *parameters, KRL_INI.strip("\n"), comment.strip("\n")]

    def files(self) -> dict[str, str]:
        """Return both files of the module with the controller's header lines."""
        head = (
            f"&ACCESS RVP1\n&REL {self.rel}\n&PARAM EDITMASK = *\n"
            "&PARAM TEMPLATE = C:\\KRC\\Roboter\\Template\\vorgabe\n&PARAM DISKPATH = KRC:\\R1\\Program\n"
        )
        dat = KRL_DAT.format(
            name=self.name,
            last=text(f"P{10 * max(1, self.count // 3)}"),
            blank=text(""), p0=text("P0"), cp=text(f"CPDAT{self.count}"), ptp=text("PDAT1"),
            v2=text("2"), v100=text("100"), sync=text("SYNCDAT"), s0=text("S0"), adat=text("ADAT0"),
            spot=f"DECL SPOT_SUGG_T LAST_SPOT={{GUN[] {text('1')},RETR_CMD[] {text('OPN')},CHOISE[] {text('FIRST')},"
            f"CLO_TM[] {text('0')},PGNO1[] {text('1')},PRESS1[] {text('2.4')},PGNO2[] {text('0')},PRESS2[] {text('0')},"
            f"SPOT_PARAMS[] {text(f'SDAT{self.spots}')}}}\n" if self.spots else "",
        )  # fmt: skip
        return {
            f"{KUKA}/Program/{self.name}.src": head + "\n".join(self.src) + "\n",
            f"{KUKA}/Program/{self.name}.dat": head + dat + "\n".join(self.dat) + "\nENDDAT\n",
        }


KRL_INI = """
;FOLD INI;%{PE}
  ;FOLD BASISTECH INI
    GLOBAL INTERRUPT DECL 3 WHEN $STOPMESS==TRUE DO IR_STOPM ( )
    INTERRUPT ON 3 
    BAS (#INITMOV,0 )
  ;ENDFOLD (BASISTECH INI)
  ;FOLD SPOTTECH INI
    USERSPOT(#INIT,SDEFAULT)
  ;ENDFOLD (SPOTTECH INI)
  ;FOLD USER INI
    ;Make your modifications here

  ;ENDFOLD (USER INI)
;ENDFOLD (INI)
"""  # noqa: W291
KRL_DAT = """\
DEFDAT  {name}
;FOLD EXTERNAL DECLARATIONS;%{{PE}}%MKUKATPBASIS,%CEXT,%VCOMMON,%P
;FOLD BASISTECH EXT;%{{PE}}%MKUKATPBASIS,%CEXT,%VEXT,%P
EXT  BAS (BAS_COMMAND  :IN,REAL  :IN )
DECL INT SUCCESS
;ENDFOLD (BASISTECH EXT)
;FOLD USER EXT;%{{E}}%MKUKATPUSER,%CEXT,%VEXT,%P
;Make your modifications here

;ENDFOLD (USER EXT)
;ENDFOLD (EXTERNAL DECLARATIONS)
DECL BASIS_SUGG_T LAST_BASIS={{POINT1[] {last},POINT2[] {p0},CP_PARAMS[] {cp},PTP_PARAMS[] {ptp},CONT[] {blank},\
CP_VEL[] {v2},PTP_VEL[] {v100},SYNC_PARAMS[] {sync},SPL_NAME[] {s0},A_PARAMS[] {adat}}}
{spot}"""


def kuka_lower(arm: Arm, cell: Cell) -> Krl:
    """Return the lower row: nine spots under base 1, clamps between them."""
    m = Krl("rear_door_u", arm, base=1, rel=112)
    spot = [(PREFIX + row[0], cell.spots[PREFIX + row[0]]) for row in LOWER]
    m.begin(KRL_LOWER_HEAD)
    m.home()
    m.wait_in(33, "Teil gespannt")
    m.src += ["INTERRUPT DECL 21 WHEN $IN[41]==FALSE DO WASSER_FEHLT ( )", "INTERRUPT ON 21"]
    m.move("PTP", "P10", cell.off("1615434", 192, (38, 24, 31), (3, -2, 1)), 120, "100", True)
    m.src.append("TRIGGER WHEN DISTANCE=0 DELAY=50 DO $OUT[17]=TRUE ;Kühlwasser Zange 1 ein")
    m.move("LIN", "P20", cell.off("1615434", 84), 90, "1", True)
    m.spot(*spot[0], 11, 2.6)
    m.spot(*spot[1], 12, 2.6)
    m.src += [
        ";FOLD Freifahren über Spanner 3",
        "LIN_REL {X 0.0,Y 0.0,Z -75.0} #TOOL",
        "LIN XP02WP1615436:{X 0,Y 0,Z -60,A 0,B 0,C 0} C_DIS",
        ";ENDFOLD",
    ]
    m.spot(*spot[2], 12, 2.6)
    m.spot(*spot[3], 12, 2.6)
    m.move("LIN", "P30", cell.off("1615437", 118, (0, -12, 14)), 95, "1", True)
    m.move("LIN", "P40", cell.off("1615438", 96, (0, 6, 9)), 95, "1", True)
    m.spot(*spot[4], 13, 2.4)
    m.spot(*spot[5], 13, 2.4)
    m.move("LIN", "P50", cell.off("1615429", 132, (6, -18, 11), (-2, 1, 0)), 95, "1", True)
    m.move("LIN", "P60", cell.off("1615430", 88, (0, 4, 0)), 95, "1", True)
    m.src += ["IF bZaehlerAktiv==TRUE THEN", "  nZaehlerHeckklappe=nZaehlerHeckklappe+1", "ENDIF"]
    for s in spot[6:]:
        m.spot(*s, 12, 2.6)
    m.src.append("LIN_REL {X 72.5,Y 0.0,Z 34.0} #BASE")
    m.move("LIN", "P70", cell.off("1615432", 158, (22, -16, 27)), 110, "1", True)
    m.src.append("TRIGGER WHEN DISTANCE=1 DELAY=0 DO $OUT[17]=FALSE")
    m.move("PTP", "P80", cell.off("1615432", 172, (52, -22, 44), (6, -4, 0)), 120, "100", True)
    m.output(21, "Reihe unten fertig", True, "0.5")
    m.src.append("INTERRUPT OFF 21")
    m.home()
    m.src += ["END", "", KRL_WATER.strip("\n")]
    return m


def kuka_upper(arm: Arm, cell: Cell) -> Krl:
    """Return the upper row: five spots under the turned base 2, in two local routines."""
    m = Krl("rear_door_o", arm, base=2, rel=96)
    spot = {row[0]: (PREFIX + row[0], cell.spots[PREFIX + row[0]]) for row in UPPER}
    m.begin(KRL_UPPER_HEAD)
    wait = cell.off("1609707", 186, (96, 108, -64), (4, 3, 0))
    m.home()
    m.wait_in(34, "Freigabe Fenster")
    m.move("PTP", "P10", wait, 120, "100", True)
    m.src += ["OBEN_RECHTS( )", "OBEN_LINKS( )"]
    m.move("PTP", "P10", wait, 120, "100", True)
    m.output(22, "Reihe oben fertig", True, "0.5")
    m.home()
    m.src += ["END", "", "DEF OBEN_RECHTS( )", ";rechte Seite, von außen nach innen"]
    m.move("LIN", "P20", cell.off("1615441", 168, (42, -8, -12), (-2, 0, 1)), 110, "1", True)
    m.move("LIN", "P30", cell.off("1615441", 82), 90, "1")
    m.spot(*spot["1615441"], 21, 2.2)
    m.spot(*spot["1615439"], 21, 2.2)
    m.spot(*spot["1609707"], 21, 2.2)
    m.move("LIN", "P40", cell.off("1609707", 124, (0, 26, -10)), 95, "1", True)
    m.src += ["END", "", "DEF OBEN_LINKS( )", "DECL INT nVersuch"]
    m.move("LIN", "P50", cell.off("1615442", 142, (18, -64, -22), (-5, 0, -3)), 95, "1", True)
    m.move("LIN", "P60", cell.off("1615442", 78), 90, "1")
    m.src += ["FOR nVersuch=1 TO 3", "  IF $IN[35]==TRUE THEN", "    EXIT", "  ENDIF", "  WAIT SEC 0.2", "ENDFOR"]
    m.spot(*spot["1615442"], 22, 2.2, vel="60", kind="PTP")
    m.spot(*spot["1609713"], 22, 2.2)
    m.move("LIN", "P70", cell.off("1609713", 91, (8, 0, -6)), 95, "1", True)
    m.move("LIN", "P80", cell.off("1609713", 184, (62, -34, -38), (4, 0, 2)), 110, "1", True)
    m.src.append("END")
    return m


def kuka_dress(arm: Arm) -> Krl:
    """Return the cap dresser, under a base of its own."""
    m = Krl("tip_dress", arm, base=5, rel=41)
    base = m.frame()
    gun = Rotation.from_euler("ZYX", [1.15, -12.4, 0.85], degrees=True) * Rotation.from_matrix(KUKA_GUN)
    m.begin(KRL_DRESS_HEAD, "DECL INT nFraes")
    m.home()
    m.move("PTP", "P10", base * RigidTransform.from_components([268.4, 12.6, 148.2], gun), 130, "100", True)
    m.move("PTP", "P20", base * RigidTransform.from_components([122.8, 0.4, 11.9], gun), 100, "50")
    m.output(43, "Fräsmotor ein", True)
    m.wait_in(44, "Drehzahl erreicht")
    m.move("LIN", "P30", base * RigidTransform.from_components([0.35, -0.2, 11.85], gun), 22, "0.3")
    m.src += [
        "FOR nFraes=1 TO 2",
        "  PULSE($OUT[45],TRUE,1.2)",
        "  WAIT SEC 1.5",
        "ENDFOR",
        "nKappenZaehler=0",
    ]
    m.move("LIN", "P20", base * RigidTransform.from_components([122.8, 0.4, 11.9], gun), 100, "0.5", True)
    m.output(43, "Fräsmotor ein", False)
    m.move("PTP", "P10", base * RigidTransform.from_components([268.4, 12.6, 148.2], gun), 130, "100", True)
    m.home()
    m.src.append("END")
    return m


KRL_LOWER_HEAD = """
;*********************************************************
;* Station 140 R01   Heckklappe, untere Reihe (9 Punkte)
;* 12.03.2014 Mü   Erstinbetriebnahme
;* 27.10.2015 Kö   Punkt 436 nachgeteacht, Spanner 3 geändert
;*********************************************************
"""
KRL_WATER = """

DEF WASSER_FEHLT( )
;Kühlwasser fehlt: anhalten, bis Durchfluss wieder da ist
BRAKE F
$OUT[47]=TRUE
WAIT FOR $IN[41]==TRUE
$OUT[47]=FALSE
END
"""
KRL_UPPER_HEAD = """
;*********************************************************
;* Station 140 R01   Heckklappe, obere Reihe (5 Punkte)
;* Zange fährt durch den Fensterausschnitt von unten an
;*********************************************************
"""
KRL_DRESS_HEAD = """
;Elektrodenkappen fräsen, Kappenfräser am Sockel rechts vom Roboter
"""


def kuka_arm() -> Arm:
    """Return the robot of the KUKA cell from $machine.dat and $config.dat."""
    machine, config = read(f"{KUKA}/Mada/$machine.dat"), read(f"{KUKA}/System/$config.dat")
    model = KinematicModel(
        a1=350, a2=41, b=0, c1=675, c2=1150, c3=1200, c4=215,
        offsets=(0, -90, 0, 0, 0, 0), flip_axes=(True, False, False, True, False, True),
    )  # fmt: skip
    limits = [[float(find(rf"\$SOFT{end}_END\[{i}\]=(\S+)", machine)) for end in "NP"] for i in range(1, 7)]
    root, tool = krl_frame("$ROBROOT", machine), krl_frame("TOOL_DATA[1]", config)
    return Arm(Robot(model), np.array(limits), root, tool, np.array(krl_numbers("XHOME", config)[:6]))


def kuka_files() -> dict[str, bytes]:
    """Return the programs of the KUKA backup."""
    arm, cell = kuka_arm(), Cell(read_spots(KUKA_GUN), (0.0, 0.0, 1.0))
    modules = kuka_lower(arm, cell), kuka_upper(arm, cell), kuka_dress(arm)
    out = {name: body for module in modules for name, body in module.files().items()}
    return {name: body.replace("\n", "\r\n").encode("cp1252") for name, body in out.items()}


# ----------------------------------------------------------------------------------------------------- ABB

# Tool Z closes the gun (sheet normal), tool X runs into the throat.
ABB_GUN = np.array([[-1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 1.0]])
EAX = "9E+09"


def trimmed(value: float, decimals: int) -> str:
    """Write a number as RobotStudio writes it: fixed decimals without trailing zeros."""
    shown = f"{value:.{decimals}f}".rstrip("0").rstrip(".")
    return "0" if shown in ("-0", "") else shown


def rapid_pose(at: RigidTransform) -> str:
    """``[x,y,z],[q1,q2,q3,q4]`` with q1 >= 0."""
    quaternion = at.rotation.as_quat(canonical=True, scalar_first=True)
    return f"[{','.join(trimmed(v, 6) for v in at.translation)}],[{','.join(trimmed(v, 9) for v in quaternion)}]"


def read_pose(shown: str) -> RigidTransform:
    """Pose of printed RAPID numbers."""
    numbers = [float(v) for v in shown.replace("[", "").replace("]", "").split(",")]
    return RigidTransform.from_components(numbers[:3], Rotation.from_quat(numbers[3:7], scalar_first=True))


def confdata(joints: Floats) -> str:
    """Return ``[cf1,cf4,cf6,cfx]`` of an IRB 6700-200/2.60, from its lengths."""
    a2, a3 = np.radians(joints[1]), np.radians(joints[2])
    wrist = 320 + 1125 * np.sin(a2) + 1142.5 * np.cos(a2 + a3) + 200 * np.sin(a2 + a3)
    lower_arm = 1142.5 * np.cos(a3) + 200 * np.sin(a3)
    cfx = 4 * int(wrist < 0) + 2 * int(lower_arm < 0) + int(joints[4] < 0)
    return "[" + ",".join(str(int(q // 90)) for q in joints[[0, 3, 5]]) + f",{cfx}]"


@dataclass
class Rapid:
    """Robtargets under one work object, in the order in which the arm visits them."""

    arm: Arm
    wobj: str
    lines: list[str] = field(default_factory=list)

    def frame(self) -> RigidTransform:
        """Return the object frame in the world, from the wobjdata."""
        data = find(rf'{self.wobj}:=\[FALSE,TRUE,"",\[(.*)\]\];', read(f"{ABB}/SYSMOD/WeldData.sys"))
        user, object_ = data.split("],[[")
        return read_pose(user) * read_pose(object_)

    def target(self, world: RigidTransform, gun: float) -> str:
        """Return a robtarget literal."""
        shown = rapid_pose(self.frame().inv() * world)
        conf = confdata(self.arm.solve(self.frame() * read_pose(shown)))
        return f"[{shown},{conf},[{trimmed(gun, 4)},{','.join([EAX] * 5)}]]"

    def declare(self, name: str, world: RigidTransform, gun: float) -> None:
        """Declare a robtarget."""
        self.lines.append(f"CONST robtarget {name}:={self.target(world, gun)};")


RAPID_HEAD = "%%%\n  VERSION:1\n  LANGUAGE:ENGLISH\n%%%\n\n"
RAPID_DOOR = """\
MODULE RearDoor
  ! Heckklappe, untere Reihe 9 Punkte, obere Reihe 5 Punkte
{targets}

  PROC rRearDoorLower()
    VAR num nRetry:=0;
    ! untere Reihe, von links nach rechts
    WaitDI diPartClamped,1\\MaxTime:=10;
    MoveJ pLow10,v1500,z50,tWeldGun1\\WObj:=wobjDoorLower;
    MoveL pLow20,v1000,z10,tWeldGun1\\WObj:=wobjDoorLower;
    SpotL P02WP1615434,v800,gun1,sdDoorLow1,tWeldGun1\\WObj:=wobjDoorLower;
    SpotL P02WP1615435,v800,gun1,sdDoorLow1,tWeldGun1\\WObj:=wobjDoorLower;
    ! über Spanner 3 fahren
    MoveL Offs(P02WP1615435,72,-14.5,38),v1000,z20,tWeldGun1\\WObj:=wobjDoorLower;
    MoveL Offs(P02WP1615436,68.5,0,36),v1000,z10,tWeldGun1\\WObj:=wobjDoorLower;
    SpotL P02WP1615436,v800,gun1,sdDoorLow1,tWeldGun1\\WObj:=wobjDoorLower;
    SpotL P02WP1615437,v800,gun1,sdDoorLow1,tWeldGun1\\WObj:=wobjDoorLower;
    MoveL pLow30,v1000,z20,tWeldGun1\\WObj:=wobjDoorLower;
    MoveL pLow40,v1000,z10,tWeldGun1\\WObj:=wobjDoorLower;
    SpotL P02WP1615438,v800,gun1,sdDoorLow2,tWeldGun1\\WObj:=wobjDoorLower;
    SpotL P02WP1615429,v800,gun1,sdDoorLow2,tWeldGun1\\WObj:=wobjDoorLower;
    MoveL RelTool(P02WP1615429,-95,0,0),v1000,z20,tWeldGun1\\WObj:=wobjDoorLower;
    MoveL pLow50,v1000,z10,tWeldGun1\\WObj:=wobjDoorLower;
    SpotL P02WP1615430,v800,gun1,sdDoorLow1,tWeldGun1\\WObj:=wobjDoorLower;
    SpotL P02WP1615431,v800,gun1,sdDoorLow1\\QuickRelease,tWeldGun1\\WObj:=wobjDoorLower;
    SpotL P02WP1615432,v800,gun1,sdDoorLow1,tWeldGun1\\WObj:=wobjDoorLower;
    MoveL pLow60,v1000,z20,tWeldGun1\\WObj:=wobjDoorLower;
    MoveJ pLow70,v1500,z50,tWeldGun1\\WObj:=wobjDoorLower;
    SetDO doLowerRowDone,1;
  ERROR
    IF ERRNO=ERR_WAIT_MAXTIME THEN
      nRetry:=nRetry+1;
      IF nRetry<3 RETRY;
      TPWrite "Teil nicht gespannt";
      Stop;
      RETRY;
    ENDIF
  ENDPROC

  PROC rRearDoorUpper()
    ! obere Reihe durch den Fensterausschnitt, Zange von unten
    MoveJ pUp10,v1500,z50,tWeldGun1\\WObj:=wobjDoorUpper;
    WaitUntil diWindowFree=1 AND bDryRun=FALSE;
    MoveL pUp20,v1000,z20,tWeldGun1\\WObj:=wobjDoorUpper;
    MoveL RelTool(P02WP1615441,-70,0,6),v1000,z5,tWeldGun1\\WObj:=wobjDoorUpper;
    SpotJ P02WP1615441,v1000,gun1,sd_P02WP1615441,tWeldGun1\\WObj:=wobjDoorUpper;
    SpotL P02WP1615439,v800,gun1,sd_P02WP1615439,tWeldGun1\\WObj:=wobjDoorUpper;
    SpotL {P02WP1609707},v800,gun1,sd_P02WP1609707,tWeldGun1\\WObj:=wobjDoorUpper;
    MoveL pUp30,v1000,z20,tWeldGun1\\WObj:=wobjDoorUpper;
    MoveL {via40},v1000,z20,tWeldGun1\\WObj:=wobjDoorUpper;
    MoveL pUp50,v1000,z5,tWeldGun1\\WObj:=wobjDoorUpper;
    SpotL {P02WP1615442},v800,gun1,sd_P02WP1615442,tWeldGun1\\WObj:=wobjDoorUpper;
    SpotL {P02WP1609713},v800,gun1,sd_P02WP1609713,tWeldGun1\\WObj:=wobjDoorUpper;
    MoveL Offs(pUp50,-48.5,12,-40),v1000,z20,tWeldGun1\\WObj:=wobjDoorUpper;
    MoveL pUp60,v1000,z20,tWeldGun1\\WObj:=wobjDoorUpper;
    MoveJ pUp10,v1500,z50,tWeldGun1\\WObj:=wobjDoorUpper;
    ! SpotL P02WP1615441,v800,gun1,sd_P02WP1615441,tWeldGun1\\WObj:=wobjDoorUpper;
    SetDO doUpperRowDone,1;
  ENDPROC
ENDMODULE
"""
RAPID_DRESS = """\
MODULE TipDress
  ! Kappenfräser am Sockel rechts vom Roboter
{targets}

  PROC rTipDress(num nMode)
    VAR num nCuts;
    MoveJ pDress10,v1500,z50,tWeldGun1\\WObj:=wobjTipDress;
    MoveL pDress20,v500,z10,tWeldGun1\\WObj:=wobjTipDress;
    SetDO doDresserOn,1;
    WaitDI diDresserSpeed,1;
    MoveL pDress30,v100,fine,tWeldGun1\\WObj:=wobjTipDress;
    FOR i FROM 1 TO nMode DO
      PulseDO\\PLength:=1.2,doDresserFeed;
      WaitTime 1.5;
      nCuts:=nCuts+1;
    ENDFOR
    MoveL pDress20,v500,z10,tWeldGun1\\WObj:=wobjTipDress;
    SetDO doDresserOn,0;
    nSpotsSinceDress:=0;
    MoveJ pDress10,v1500,z50,tWeldGun1\\WObj:=wobjTipDress;
  ENDPROC
ENDMODULE
"""


def abb_door(arm: Arm, cell: Cell) -> str:
    """Return the weld module: declared targets in the lower row, declared and inline ones in the upper row."""
    low = Rapid(arm, "wobjDoorLower")
    low.declare("pLow10", cell.off("1615434", 188, (42, 21, 34), (2, -3, 1)), 120)
    low.declare("pLow20", cell.off("1615434", 86, (0, 3, 2)), 98.6959)
    for name, *_ in LOWER:
        if name == "1615438":
            low.declare("pLow30", cell.off("1615437", 121, (0, -14, 12)), 98.6959)
            low.declare("pLow40", cell.off("1615438", 92, (0, 8, 7)), 98.6959)
        if name == "1615430":
            low.declare("pLow50", cell.off("1615430", 90, (0, 5, 0), (1, 0, 0)), 98.6959)
        low.declare(PREFIX + name, cell.spots[PREFIX + name], 18)
    low.declare("pLow60", cell.off("1615432", 154, (20, -14, 24)), 115)
    low.declare("pLow70", cell.off("1615432", 170, (50, -24, 42), (5, -3, 0)), 120)
    up = Rapid(arm, "wobjDoorUpper")
    up.declare("pUp10", cell.off("1609707", 182, (88, 104, -58), (4, 2, 0)), 120)
    up.declare("pUp20", cell.off("1615441", 164, (38, -6, -14), (-1.5, 0, 1)), 115)
    for name in ("1615441", "1615439"):
        up.declare(PREFIX + name, cell.spots[PREFIX + name], 18)
    inline = {PREFIX + "1609707": up.target(cell.spots[PREFIX + "1609707"], 18)}
    up.declare("pUp30", cell.off("1609707", 122, (0, 24, -8)), 98.6959)
    inline["via40"] = up.target(cell.off("1615442", 148, (24, -66, -18), (-4, 0, -2)), 98.6959)
    up.declare("pUp50", cell.off("1615442", 81), 98.6959)
    inline |= {PREFIX + n: up.target(cell.spots[PREFIX + n], 18) for n in ("1615442", "1609713")}
    up.declare("pUp60", cell.off("1609713", 176, (58, -30, -34), (3, 0, 2)), 115)
    return RAPID_DOOR.format(targets="\n".join("  " + line for line in low.lines + up.lines), **inline)


def abb_dress(arm: Arm) -> str:
    """Return the cap dresser, under a work object of its own."""
    module = Rapid(arm, "wobjTipDress")
    gun = Rotation.from_euler("ZYX", [-1.4, -11.8, 1.2], degrees=True) * Rotation.from_matrix(ABB_GUN)
    points = ("10", (262.5, 9.5, 151), 130), ("20", (124, 0.5, 12), 100), ("30", (0.4, -0.3, 11.9), 22)
    for name, at, opening in points:
        module.declare("pDress" + name, module.frame() * RigidTransform.from_components(at, gun), opening)
    return RAPID_DRESS.format(targets="\n".join("  " + line for line in module.lines))


def abb_arm() -> Arm:
    """Return the robot of the ABB cell from MOC.cfg, its tooldata and its home."""
    moc = read("abb/SYSPAR/MOC.cfg")
    model = KinematicModel(
        a1=320, a2=-200, b=0, c1=780, c2=1125, c3=1142.5, c4=200, offsets=(0, 0, -90, 0, 0, 0), flip_axes=(False,) * 6
    )
    arms = [find(rf'(-name "rob1_{i}" -use_arm_type[\s\S]*?)\r\n', moc) for i in range(1, 7)]
    ends = ("lower", "upper")
    limits = [[np.degrees(float(find(rf"-{end}_joint_bound (\S+)", arm))) for end in ends] for arm in arms]
    x, y, z = (1000.0 * float(find(rf"-base_frame_pos_{axis} ([^\s\\]+)", moc)) for axis in "xyz")
    u0, u3 = (float(find(rf"-base_frame_orient_{u} ([^\s\\]+)", moc)) for u in ("u0", "u3"))
    root = RigidTransform.from_components([x, y, z], Rotation.from_quat([u0, 0, 0, u3], scalar_first=True))
    tool = read_pose(find(r"tWeldGun1:=\[TRUE,\[(\[.*?\],\[.*?\])\]", read(f"{ABB}/SYSMOD/WeldData.sys")))
    home = find(r"jHome:=\[\[(.*?)\]", read(f"{ABB}/PROGMOD/MainModule.mod"))
    return Arm(Robot(model), np.array(limits), root, tool, np.array([float(v) for v in home.split(",")]))


def abb_files() -> dict[str, bytes]:
    """Return the programs of the ABB backup."""
    arm, cell = abb_arm(), Cell(read_spots(ABB_GUN), (1.0, 0.0, 0.0))
    programs = {"RearDoor": abb_door(arm, cell), "TipDress": abb_dress(arm)}
    return {
        f"{ABB}/PROGMOD/{name}.mod": (RAPID_HEAD + body).replace("\n", "\r\n").encode("latin-1")
        for name, body in programs.items()
    }


def main() -> int:
    """Write the files, or compare them with what is on disk."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--check", action="store_true", help="write nothing; exit 1 if any file on disk differs")
    check = parser.parse_args().check
    files = kuka_files() | abb_files()
    different = []
    for name, body in files.items():
        path = ROOT / name
        if not path.is_file() or path.read_bytes() != body:
            different.append(name)
            if not check:
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_bytes(body)
    for name in different:
        print(("differs: " if check else "written: ") + name)
    return 1 if check and different else 0


if __name__ == "__main__":
    sys.exit(main())
