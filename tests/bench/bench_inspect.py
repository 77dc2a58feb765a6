"""What `respot inspect` costs beside `respot check -j 1`, on made-up backups, in one run.

Usage: ``python tests/bench/bench_inspect.py [--megabytes 20] [--repeat 3]``

Both are run as a user runs them, in processes of their own, one after the other; the fastest of each counts. A backup
holds programs of the size and the mix of shapes that public ones have, each with its targets and frames.
"""

from __future__ import annotations

import argparse
import random
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from made_up import krl_programs, rapid_programs

_CONFIG = "DEFDAT $CONFIG\r\n{frames}\r\nENDDAT\r\n"


def krl_backup(folder: Path, size: int) -> None:
    """Write a KRC backup: modules of 60 points, each with its inline form, and programs with logic."""
    frames = [
        f"{kind}_DATA[{n}]={{X {n}.0,Y 0.0,Z 100.0,A {n}.0,B 0.0,C 0.0}}"
        for kind in ("TOOL", "BASE")
        for n in range(1, 17)
    ]
    system = folder / "KRC" / "R1" / "System"
    system.mkdir(parents=True)
    (system / "$config.dat").write_bytes(_CONFIG.format(frames="\r\n".join(frames)).encode())
    program = folder / "KRC" / "R1" / "Program"
    program.mkdir()
    dice = random.Random(5)
    total = 0
    for number, logic in enumerate(krl_programs(size // 8)):
        (program / f"style{number}.src").write_bytes(logic)
        total += len(logic)
    number = 0
    while total < size:
        source, data = _krl_module(dice, number)
        (program / f"weld{number}.src").write_bytes(source)
        (program / f"weld{number}.dat").write_bytes(data)
        total += len(source) + len(data)
        number += 1


def _krl_module(dice: random.Random, number: int) -> tuple[bytes, bytes]:
    source = ["&ACCESS RVP", "&REL 7", f"DEF WELD{number} ( )"]
    data = ["&ACCESS RVP", f"DEFDAT  WELD{number}"]
    for point in range(1, 61):
        base, velocity = dice.randrange(1, 17), dice.choice((0.5, 1, 2))
        title = f"LIN P{point} CONT Vel={velocity} m/s CPDAT{point} Tool[1]:GUN Base[{base}]:PART"
        tail = (
            f"%{{PE}}%R 8.3.21,%MKUKATPBASIS,%CMOVE,%VLIN,%P 1:LIN, 2:P{point}, 3:C_DIS, 5:{velocity}, 7:CPDAT{point}"
        )
        source += [
            f";FOLD {title};{tail}",
            "$BWDSTART=FALSE",
            f"LDAT_ACT=LCPDAT{point}",
            f"FDAT_ACT=FP{point}",
            f"BAS(#CP_PARAMS,{velocity})",
            f"LIN XP{point} C_DIS",
            ";ENDFOLD",
        ]
        xyz = ",".join(f"{axis} {dice.uniform(-2500, 2500):.4f}" for axis in "XYZ")
        abc = ",".join(f"{axis} {dice.uniform(-90, 90):.5f}" for axis in "ABC")
        external = ",".join(f"E{n} 0.0" for n in range(1, 7))
        data += [
            f"DECL E6POS XP{point}={{{xyz},{abc},S 2,T {dice.randrange(64)},{external}}}",
            f'DECL FDAT FP{point}={{TOOL_NO 1,BASE_NO {base},IPO_FRAME #BASE,POINT2[] " ",TQ_STATE FALSE}}',
            f"DECL LDAT LCPDAT{point}={{VEL 2.0,ACC 100.0,APO_DIST 100.0,APO_FAC 50.0,ORI_TYP #VAR}}",
        ]
    return "\r\n".join([*source, "END", ""]).encode("cp1252"), "\r\n".join([*data, "ENDDAT", ""]).encode("cp1252")


def rapid_backup(folder: Path, size: int) -> None:
    """Write an IRC5 backup: the made-up programs, and the frames they use."""
    modules = folder / "RAPID" / "TASK1" / "PROGMOD"
    modules.mkdir(parents=True)
    for number, module in enumerate(rapid_programs(size)):
        (modules / f"Style{number}.mod").write_bytes(module)


def main() -> None:
    """Print the ratio for both languages."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--megabytes", type=float, default=20.0)
    parser.add_argument("--repeat", type=int, default=3)
    options = parser.parse_args()
    for name, make in (("KRL", krl_backup), ("RAPID", rapid_backup)):
        with tempfile.TemporaryDirectory() as folder:
            make(Path(folder), int(options.megabytes * 1e6))
            size = sum(file.stat().st_size for file in Path(folder).rglob("*") if file.is_file())
            best: dict[str, float] = {}
            for _ in range(options.repeat):
                for command in (("check", "-j", "1"), ("inspect",), ("inspect", "--json")):
                    taken = _run([*command[:1], folder, *command[1:]])
                    key = " ".join(command)
                    best[key] = min(taken, best.get(key, taken))
            check = best["check -j 1"]
            ratios = ", ".join(f"{key} {taken / check:.2f}x" for key, taken in best.items())
            print(f"{name}: {size / 1e6:.1f} MB, check -j 1 = 1 ({size / 1e6 / check:.1f} MB/s): {ratios}")


def _run(arguments: list[str]) -> float:
    start = time.perf_counter()
    subprocess.run(
        [sys.executable, "-m", "respot", *arguments], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, check=False
    )
    return time.perf_counter() - start


if __name__ == "__main__":
    main()
