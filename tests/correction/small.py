"""Small backups, written line by line, and a calibration with a large turn, so that a wrong frame shows."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from typer.testing import CliRunner

from respot.calibration.calibration import Calibration
from respot.cli import app
from tests.difference.witness import assert_witnessed

SPOTS = {"S1": (1000, 0, 500), "S2": (1400, 0, 500), "S3": (1000, 600, 500), "S4": (1200, 300, 900)}
TURN = np.array([[np.cos(0.05), -np.sin(0.05), 0], [np.sin(0.05), np.cos(0.05), 0], [0, 0, 1]])
SHIFT = np.array([20.0, -30.0, 10.0])


def moved(point) -> np.ndarray:
    return TURN @ np.asarray(point, dtype=float) + SHIFT


@dataclass
class Converted:
    code: int
    record: dict
    err: str
    folder: Path
    texts: dict[str, str] = field(default_factory=dict)

    def refusals(self) -> set[tuple[str, str, str]]:
        return {(item["program"], item["target"], item["code"]) for item in self.record["refused"]}

    def stays(self) -> dict[str, str]:
        return {item["target"]: item["code"] for item in self.record["unmoved"]}

    def edited(self) -> set[str]:
        return {edit["target"] for edit in self.record["edits"]}

    def text(self, name: str) -> str:
        (path,) = [path for path in self.folder.rglob("*") if path.name == name]
        return path.read_bytes().decode("latin-1")


def convert(tmp_path: Path, files: dict[str, str], *options: str, translation=SHIFT, name: str = "out") -> Converted:
    backup = tmp_path / "backup"
    for path, text in files.items():
        place = backup / path
        place.parent.mkdir(parents=True, exist_ok=True)
        place.write_bytes(text.replace("\n", "\r\n").encode("latin-1"))
    return convert_again(tmp_path, backup, *options, translation=translation, name=name)


def convert_again(tmp_path: Path, backup: Path, *options: str, translation=SHIFT, name: str = "out") -> Converted:
    made = Calibration(TURN, np.asarray(translation, dtype=float), "theory", "same", tuple(SPOTS))
    (tmp_path / f"{name}.json").write_text(made.to_json())
    arguments = ["convert", str(backup), "-c", str(tmp_path / f"{name}.json"), "-o", str(tmp_path / name), "--json"]
    result = CliRunner().invoke(app, [*arguments, *options])
    record = json.loads(result.stdout) if result.stdout else {}
    if record and (tmp_path / name).is_dir():  # whatever is written, an independent witness sees the same
        assert_witnessed(record["edits"], backup, tmp_path / name)
    return Converted(result.exit_code, record, result.stderr, tmp_path / name)


# ------------------------------------------------------------------------------------------------------------------ KRL

CONFIG = """DEFDAT  $CONFIG
DECL FRAME TOOL_DATA[16]
DECL FRAME BASE_DATA[32]
TOOL_DATA[1]={X 0.0,Y 0.0,Z 300.0,A 0.0,B 0.0,C 0.0}
BASE_DATA[1]={X 1000.0,Y 0.0,Z 500.0,A 90.0,B 0.0,C 0.0}
BASE_DATA[2]={X 0.0,Y 0.0,Z 0.0,A 0.0,B 0.0,C 0.0}
BASE_DATA[5]={X -500.0,Y 200.0,Z 0.0,A 0.0,B 0.0,C 0.0}
E6AXIS XHOME={A1 0.0,A2 -90.0,A3 90.0,A4 0.0,A5 0.0,A6 0.0,E1 0.0,E2 0.0,E3 0.0,E4 0.0,E5 0.0,E6 0.0}
ENDDAT
"""


def krl_point(name: str, x, y, z, more: str = "", kind: str = "E6POS") -> str:
    return f"DECL {kind} X{name}={{X {x:.4f},Y {y:.4f},Z {z:.4f},A 0.0,B 0.0,C 0.0{more}}}\n"


def krl_in_base1(point) -> tuple[float, float, float]:
    """World point seen from BASE_DATA[1]: turned by -90 degrees about z, its origin at 1000, 0, 500."""
    x, y, z = np.asarray(point, dtype=float) - [1000.0, 0.0, 500.0]
    return y, -x, z


def fdat(name: str, base: int = 1, mode: str = "#BASE") -> str:
    return f'DECL FDAT F{name}={{TOOL_NO 1,BASE_NO {base},IPO_FRAME {mode},POINT2[] " "}}\n'


def lin(name: str, operand: str = "", weld: bool = False) -> str:
    text = f"FDAT_ACT=F{name}\nBAS(#CP_PARAMS,1)\nLIN {operand or 'X' + name}\n"
    return text + ("USERSPOT(#SPOT,S_ACT)\n" if weld else "")


def krl(body: str = "", data: str = "", after: str = "", more: dict[str, str] | None = None) -> dict[str, str]:
    """Backup with the module ``weld`` that welds S1 to S4 under base 1, then runs ``body``."""
    src = "&ACCESS RVP\nDEF weld( )\n" + "".join(lin(name, weld=True) for name in SPOTS) + body + "END\n" + after
    dat = "&ACCESS RVP\nDEFDAT  WELD\n"
    dat += (
        "".join(krl_point(name, *krl_in_base1(place)) + fdat(name) for name, place in SPOTS.items()) + data + "ENDDAT\n"
    )
    program = "KRC/R1/Program/"
    files = {f"{program}weld.src": src, f"{program}weld.dat": dat, "KRC/R1/System/$config.dat": CONFIG}
    return {**files, **{program + name: text for name, text in (more or {}).items()}}


# ---------------------------------------------------------------------------------------------------------------- RAPID

DATA = """MODULE Frames(SYSMODULE)
  PERS tooldata tGun:=[TRUE,[[0,0,300],[1,0,0,0]],[1,[0,0,1],[1,0,0,0],0,0,0]];
  PERS tooldata tFixed:=[FALSE,[[0,0,300],[1,0,0,0]],[1,[0,0,1],[1,0,0,0],0,0,0]];
  PERS wobjdata wDoor:=[FALSE,TRUE,"",[[1000,0,500],[0.707106781186548,0,0,0.707106781186548]],[[0,0,0],[1,0,0,0]]];
  PERS wobjdata wDress:=[FALSE,TRUE,"",[[-500,200,0],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];
  PERS wobjdata wTurn:=[FALSE,FALSE,"STN1",[[0,0,0],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];
  PERS wobjdata wPart:=[TRUE,TRUE,"",[[0,0,0],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];
  PERS gundata gun1:=["gun1",1];
  PERS spotdata sd1:=[1,2000,1,0];
ENDMODULE
"""


def robtarget(x, y, z) -> str:
    return f"[[{x:.4f},{y:.4f},{z:.4f}],[1,0,0,0],[0,0,0,0],[9E9,9E+09,9E9,9E9,9E9,9E9]]"


def rapid(body: str = "", data: str = "", after: str = "", more: dict[str, str] | None = None) -> dict[str, str]:
    """Backup with the module ``Weld`` that welds S1 to S4 under wDoor, then runs ``body``."""
    text = "MODULE Weld\n"
    text += "".join(f"  CONST robtarget {name}:={robtarget(*krl_in_base1(place))};\n" for name, place in SPOTS.items())
    text += data + "  PROC rWeld()\n"
    text += "".join(f"    SpotL {name},v800,gun1,sd1,tGun\\WObj:=wDoor;\n" for name in SPOTS) + body
    text += "  ENDPROC\n" + after + "ENDMODULE\n"
    files = {"RAPID/TASK1/PROGMOD/Weld.mod": text, "RAPID/TASK1/SYSMOD/Frames.sys": DATA}
    return {**files, **{f"RAPID/TASK1/PROGMOD/{name}": content for name, content in (more or {}).items()}}
