"""Small backups with several tools and bases, and lists of where their spots are, by scipy alone: nothing of the engine.

A spot is written under one tool and base and may really be under others; where that puts it is worked out here from the
frames' own numbers.
"""

from __future__ import annotations

import csv
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from scipy.spatial.transform import RigidTransform, Rotation

BASES = {
    1: (1200.0, -400.0, 500.0, 0.0, 0.0, 0.0),
    2: (1350.0, 300.0, 520.0, 12.0, 0.0, 0.0),
    3: (1180.0, 650.0, 480.0, -8.0, 3.0, 1.0),
    4: (1205.1, 646.8, 480.4, -8.0, 3.0, 1.0),  # 25.1 -3.2 0.4 from base 3, turned alike
    6: (1500.0, 120.0, 700.0, 90.0, 0.0, 10.0),
}
TOOLS = {
    1: (120.0, 0.0, 540.0, 0.0, 90.0, 0.0),
    2: (-80.0, 35.0, 610.0, 30.0, 90.0, 0.0),
    3: (118.0, 0.0, 575.0, 0.0, 90.0, 0.0),
}
REGISTRATION = (310.0, -220.0, 45.0, 17.0, -3.0, 2.0)


def pose(numbers) -> RigidTransform:
    """KUKA frame: R = Rz(A) Ry(B) Rx(C)."""
    turn = Rotation.from_euler("ZYX", numbers[3:], degrees=True)
    return RigidTransform.from_components(np.array(numbers[:3], dtype=float), turn)


@dataclass(frozen=True)
class Group:
    """Spots of one program: what it writes, and what is real; None where that is the same."""

    spots: int = 14
    base: int = 1
    tool: int = 1
    real_base: int | None = None
    real_tool: int | None = None
    real_pose: RigidTransform | None = None
    shift: tuple[float, float, float] = (0.0, 0.0, 0.0)
    line: bool = False


@dataclass
class Cell:
    """Programs and frames."""

    groups: Mapping[str, Group]
    bases: Mapping[int, tuple[float, ...]] = field(default_factory=lambda: dict(BASES))
    tools: Mapping[int, tuple[float, ...]] = field(default_factory=lambda: dict(TOOLS))
    noise: float = 0.1
    seed: int = 3
    registration: tuple[float, ...] = REGISTRATION
    swapped: tuple[tuple[str, str], ...] = ()

    def __post_init__(self) -> None:
        dice = np.random.default_rng(self.seed)
        self.written: dict[str, list[tuple[str, RigidTransform]]] = {}
        self.places: list[tuple[str, RigidTransform, Group]] = []
        for number, (program, group) in enumerate(self.groups.items()):
            middle = np.array([1400.0 + 60.0 * number, -500.0 + 420.0 * number, 700.0])
            points = middle + dice.uniform(-1.0, 1.0, (group.spots, 3)) * [250.0, 250.0, 200.0]
            if group.line:
                points = middle + np.linspace(-250.0, 250.0, group.spots)[:, None] * [0.8, 0.6, 0.0]
            turns = Rotation.from_euler("ZYX", dice.uniform(-70.0, 70.0, (group.spots, 3)), degrees=True)
            spots = [
                (f"S{number + 1}{row:02d}", RigidTransform.from_components(points[row], turns[row]))
                for row in range(group.spots)
            ]
            self.written[program] = spots
            self.places += [(name, place, group) for name, place in spots]

    def real(self, place: RigidTransform, group: Group) -> RigidTransform:
        """Where a spot is whose target was written for other frames."""
        base = pose(self.bases[group.base]) if group.base else RigidTransform.identity()
        if group.real_base is not None:
            other = pose(self.bases[group.real_base]) if group.real_base else RigidTransform.identity()
            place = other * (base.inv() * place)
        if group.real_pose is not None:
            place = group.real_pose * (base.inv() * place)
        if group.real_tool is not None:
            flange = place * pose(self.tools[group.tool]).inv()
            place = flange * pose(self.tools[group.real_tool])
        return RigidTransform.from_translation(np.array(group.shift)) * place

    def write_reference(self, path: Path) -> None:
        """Write the list of where spots are, in its own frame."""
        dice = np.random.default_rng(self.seed + 1)
        seen = pose(self.registration)
        with path.open("w", encoding="utf-8", newline="") as file:
            writer = csv.writer(file)
            writer.writerow(["id", "x", "y", "z"])
            names = {name: other for pair in self.swapped for name, other in (pair, pair[::-1])}
            for name, place, group in self.places:
                there = np.asarray((seen * self.real(place, group)).translation) + dice.normal(0.0, self.noise, 3)
                writer.writerow([names.get(name, name), *(f"{value:.4f}" for value in there)])

    def write_krl(self, folder: Path) -> None:
        """Write a KRC4-like backup."""
        config = "DEFDAT  $CONFIG\nDECL FRAME TOOL_DATA[16]\nDECL FRAME BASE_DATA[32]\n"
        for kind, frames, most in (("TOOL", self.tools, 16), ("BASE", self.bases, 32)):
            for number in range(1, most + 1):
                config += f"{kind}_DATA[{number}]={{{_krl(frames.get(number, (0.0,) * 6))}}}\n"
        files = {"KRC/R1/System/$config.dat": config + "ENDDAT\n"}
        for program, spots in self.written.items():
            group = self.groups[program]
            base = pose(self.bases[group.base]) if group.base else RigidTransform.identity()
            src, dat = f"&ACCESS RVP\nDEF {program}( )\n", f"&ACCESS RVP\nDEFDAT  {program.upper()}\n"
            for name, place in spots:
                local = base.inv() * place
                numbers = [*local.translation, *local.rotation.as_euler("ZYX", degrees=True)]
                dat += f"DECL E6POS X{name}={{{_krl(numbers)}}}\n"
                dat += f'DECL FDAT F{name}={{TOOL_NO {group.tool},BASE_NO {group.base},IPO_FRAME #BASE,POINT2[] " "}}\n'
                src += f"FDAT_ACT=F{name}\nBAS(#CP_PARAMS,1)\nLIN X{name}\nUSERSPOT(#SPOT,S_ACT)\n"
            files[f"KRC/R1/Program/{program}.src"] = src + "END\n"
            files[f"KRC/R1/Program/{program}.dat"] = dat + "ENDDAT\n"
        _write(folder, files)

    def write_rapid(self, folder: Path, users: Mapping[int, tuple[float, ...]] | None = None) -> None:
        """Write an IRC5-like backup; ``users`` are the user frames of some work objects."""
        text = "MODULE Frames(SYSMODULE)\n"
        for number, numbers in self.tools.items():
            text += f"  PERS tooldata tGun{number}:=[TRUE,[{_rapid(pose(numbers))}],[1,[0,0,1],[1,0,0,0],0,0,0]];\n"
        for number, numbers in self.bases.items():
            user = pose((users or {}).get(number, (0.0,) * 6))
            frames = f"[{_rapid(user)}],[{_rapid(user.inv() * pose(numbers))}]"
            text += f'  PERS wobjdata wFix{number}:=[FALSE,TRUE,"",{frames}];\n'
        text += '  PERS gundata gun1:=["gun1",1];\n  PERS spotdata sd1:=[1,2000,1,0];\nENDMODULE\n'
        files = {"RAPID/TASK1/SYSMOD/Frames.sys": text}
        for program, spots in self.written.items():
            group = self.groups[program]
            base = pose(self.bases[group.base]) if group.base else RigidTransform.identity()
            data, body = "", ""
            for name, place in spots:
                target = f"[{_rapid(base.inv() * place)},[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]"
                data += f"  CONST robtarget {name}:={target};\n"
                frame = f"\\WObj:=wFix{group.base}" if group.base else ""
                body += f"    SpotL {name},v800,gun1,sd1,tGun{group.tool}{frame};\n"
            text = f"MODULE {program}\n{data}  PROC r{program}()\n{body}  ENDPROC\nENDMODULE\n"
            files[f"RAPID/TASK1/PROGMOD/{program}.mod"] = text
        _write(folder, files)


def _krl(numbers) -> str:
    return ",".join(f"{name} {value:.6f}" for name, value in zip("XYZABC", numbers, strict=True))


def _rapid(place: RigidTransform) -> str:
    at = ",".join(f"{value:.6f}" for value in place.translation)
    turn = ",".join(f"{value:.12f}" for value in place.rotation.as_quat(scalar_first=True))
    return f"[{at}],[{turn}]"


def _write(folder: Path, files: Mapping[str, str]) -> None:
    for path, text in files.items():
        place = folder / path
        place.parent.mkdir(parents=True, exist_ok=True)
        place.write_bytes(text.replace("\n", "\r\n").encode("cp1252"))
