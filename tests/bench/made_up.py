"""Made-up inputs of the reading benchmark: point tables, and programs that repeat their shapes as real ones do."""

from __future__ import annotations

import random
import re


def krl_table(size: int, seed: int = 1) -> bytes:
    """Return a data list as a pendant writes it: points, FDAT and PDAT lines, comments."""
    dice = random.Random(seed)
    lines = ["&ACCESS RVP", "&REL 12", "DEFDAT  SPOTS PUBLIC", ";FOLD EXTERNAL DECLARATIONS;%{PE}%MKUKATPBASIS"]
    total, number = 0, 0
    while total < size:
        number += 1
        xyz = ",".join(f"{axis} {dice.uniform(-2500, 2500):.6g}" for axis in "XYZ")
        abc = ",".join(f"{axis} {dice.uniform(-180, 180):.6g}" for axis in "ABC")
        external = ",".join(f"E{i} 0.0" for i in range(1, 7))
        base = dice.randrange(1, 9)
        new = [
            f"DECL E6POS XP{number}={{{xyz},{abc},S {dice.choice((2, 6, 22))},T {dice.randrange(64)},{external}}}",
            f'DECL FDAT FP{number}={{TOOL_NO {dice.randrange(1, 16)},BASE_NO {base},IPO_FRAME #BASE,POINT2[] " ",TQ_STATE FALSE}}',
            f"DECL PDAT PPDAT{number}={{VEL {dice.randrange(10, 101)}.000,ACC 100.000,APO_DIST 100.000,APO_MODE #CDIS}}",
        ]
        if number % 10 == 0:
            new.append(f"; station {number}")
        lines += new
        total += sum(map(len, new)) + 2 * len(new)
    return "\r\n".join([*lines, ";ENDFOLD", "ENDDAT", ""]).encode("cp1252")


def rapid_table(size: int, seed: int = 1) -> bytes:
    """Return a module of robtargets."""
    dice = random.Random(seed)
    lines, total, number = ["MODULE Spots"], 0, 0
    while total < size:
        number += 1
        xyz = ",".join(f"{dice.uniform(-2500, 2500):.7g}" for _ in range(3))
        quaternion = ",".join(f"{dice.uniform(-1, 1):.9g}" for _ in range(4))
        configuration = f"{dice.randrange(-2, 2)},{dice.randrange(-2, 2)},{dice.randrange(-2, 2)},0"
        line = f"  CONST robtarget p{number}:=[[{xyz}],[{quaternion}],[{configuration}],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];"
        lines.append(line)
        total += len(line) + 2
    return "\r\n".join([*lines, "ENDMODULE", ""]).encode("latin-1")


def krl_programs(size: int, seed: int = 1) -> list[bytes]:
    """Return programs with inline forms, logic and calls; about one new shape of statement in a hundred lines."""
    dice = random.Random(seed)
    programs: list[bytes] = []
    total = 0
    while total < size:
        programs.append(_program(dice, len(programs)))
        total += len(programs[-1])
    return programs


def _program(dice: random.Random, index: int) -> bytes:
    lines = [
        "&ACCESS RVP",
        f"&REL {dice.randrange(1, 400)}",
        f"DEF STYLE{index} ( )",
        "DECL INT COUNT, STATE",
        "BOOL DONE",
    ]
    for _ in range(dice.randrange(20, 120)):
        lines += dice.choice((_form, _form, _condition, _assignment, _trigger, _wait, _loop))(dice)
    return "\r\n".join([*lines, "END", ""]).encode("cp1252")


def _term(dice: random.Random, depth: int = 0) -> str:
    choice = dice.randrange(9 if depth < 2 else 5)
    if choice == 0:
        return str(dice.randrange(100))
    if choice == 1:
        return f"{dice.uniform(-50, 50):.3f}"
    if choice < 4:
        return dice.choice(("COUNT", "STATE", "$VEL.CP", "OFFSET", "$POS_ACT.X", f"TABLE[{dice.randrange(9)}]"))
    if choice == 4:
        return f"$IN[{dice.randrange(1, 1024)}]"
    if choice == 5:
        return f"ABS({_term(dice, depth + 1)})"
    if choice == 6:
        return f"({_term(dice, depth + 1)}{dice.choice('+-*/')}{_term(dice, depth + 1)})"
    return f"{_term(dice, depth + 1)} {dice.choice('+-*/')} {_term(dice, depth + 1)}"


def _test(dice: random.Random) -> str:
    comparison = ("==", "<>", ">", "<=")
    tests = [f"({_term(dice, 1)}{dice.choice(comparison)}{_term(dice, 1)})" for _ in range(dice.randrange(1, 3))]
    return dice.choice((" AND ", " OR ")).join(tests)


#: Programs of a plant say the same again with other names and numbers: 142,000 public lines have 1,700 shapes.
_POOL_DICE = random.Random(7)
_TERMS = [_term(_POOL_DICE) for _ in range(700)]
_TESTS = [_test(_POOL_DICE) for _ in range(700)]
_WORD = re.compile(r"\b(?:COUNT|STATE|OFFSET|TABLE|[0-9]+)\b")


def _again(dice: random.Random, pool: list[str]) -> str:
    """Return an expression of the pool with other names and numbers."""

    def other(match: re.Match[str]) -> str:
        return str(dice.randrange(1000)) if match[0].isdigit() else f"{match[0]}_{dice.choice('ABCDEFGHJK')}"

    return _WORD.sub(other, dice.choice(pool))


def _rapid_target(dice: random.Random) -> str:
    numbers = [[f"{dice.uniform(-2000, 2000):.6g}" for _ in range(3)], [f"{dice.uniform(-1, 1):.9g}" for _ in range(4)]]
    numbers += [
        [str(dice.randrange(-2, 2)) for _ in range(3)] + ["0"],
        ["9E+09", f"{dice.uniform(0, 200):.5g}", *["9E9"] * 4],
    ]
    return f"[{','.join(f'[{chr(44).join(group)}]' for group in numbers)}]"


def rapid_array(size: int, seed: int = 3) -> bytes:
    """Return a module with one array of robtargets, a row a line."""
    dice = random.Random(seed)
    rows: list[str] = []
    total = 0
    while total < size:
        rows.append(_rapid_target(dice))
        total += len(rows[-1]) + 5
    table = f"  PERS robtarget targets{{{len(rows)}}}:=["
    return "\r\n".join(["MODULE Table", table, ",\r\n  ".join(rows), "];", "ENDMODULE", ""]).encode("latin-1")


def rapid_programs(size: int, seed: int = 4) -> list[bytes]:
    """Return programs with inline targets, spot welding, logic and calls."""
    dice = random.Random(seed)
    programs: list[bytes] = []
    total = 0
    while total < size:
        lines = ["%%%", "  VERSION:1", "  LANGUAGE:ENGLISH", "%%%", "", f"MODULE Style{len(programs)}"]
        points = range(dice.randrange(5, 30))
        lines += [f"  CONST robtarget p{index}0:={_rapid_target(dice)};" for index in points]
        for index in range(dice.randrange(3, 9)):
            lines += ["", f"  PROC rPart{index}(num count\\switch fast)"]
            for _ in range(dice.randrange(10, 50)):
                lines += dice.choice((_rapid_move, _rapid_move, _rapid_spot, _rapid_block, _rapid_logic))(dice)
            lines += ["  ERROR", "    IF ERRNO=ERR_WAIT_MAXTIME RETRY;", "    RAISE;", "  ENDPROC"]
        programs.append("\r\n".join([*lines, "ENDMODULE", ""]).encode("latin-1"))
        total += len(programs[-1])
    return programs


def _rapid_move(dice: random.Random) -> list[str]:
    target = dice.choice(
        (f"p{dice.randrange(300)}", _rapid_target(dice), f"Offs(p{dice.randrange(99)},0,0,{dice.randrange(99)})")
    )
    option = dice.choice(("", f"\\ID:={dice.randrange(99)}"))
    wobj = dice.choice(("", f"\\WObj:=wobj{dice.randrange(9)}"))
    return [
        f"    Move{dice.choice('LJ')} {target}{option},v{dice.randrange(9)}00,z{dice.randrange(9)}0,tGun{dice.randrange(4)}{wobj};"
    ]


def _rapid_spot(dice: random.Random) -> list[str]:
    name = f"wp{dice.randrange(30000, 40000)}"
    option = dice.choice(("", "\\QuickRelease", ",\\InPos\\NoConc"))
    return [f"    !{name}", f"    SpotL {name},vmax,gun{dice.randrange(4)},Sd_{name}_20{option},tGun\\WObj:=wPart;"]


#: 98,000 public statements of RAPID have 2,800 shapes.
_RAPID_POOLS = (_TERMS[:150], _TESTS[:100])


def _rapid_expression(dice: random.Random) -> str:
    other = str.maketrans({"$": "n", "[": "{", "]": "}"})
    text = _again(dice, dice.choice(_RAPID_POOLS)).translate(other)
    return text.replace("==", "=").replace("nIN{", "inputs{")


def _rapid_logic(dice: random.Random) -> list[str]:
    names = ("count", "state", "offset.x", "table{3}")
    return [
        f"    {dice.choice(names)}:={_rapid_expression(dice)}; ! set",
        f"    IF {_rapid_expression(dice)} GOTO again;",
        f"    WaitDI di{dice.randrange(99)},{dice.randrange(2)}\\MaxTime:=0.{dice.randrange(1, 9)};",
        f'    TPWrite "station "\\Num:={dice.randrange(99)};',
    ]


def _rapid_block(dice: random.Random) -> list[str]:
    return [
        f"    IF {_rapid_expression(dice)} THEN",
        f"      rPart{dice.randrange(9)} {dice.randrange(9)}\\fast;",
        "    ENDIF",
    ]


def _form(dice: random.Random) -> list[str]:
    point, tool, base = dice.randrange(1, 300), dice.randrange(1, 16), dice.randrange(1, 32)
    kind, speed = dice.choice((("PTP", "100 %"), ("LIN", "0.5 m/s")))
    letter, group = ("P", "PTP_PARAMS,100") if kind == "PTP" else ("L", "CP_PARAMS,0.5")
    blend = dice.choice(("", " C_DIS", " C_DIS C_DIS"))
    return [
        f";FOLD {kind} P{point} Vel={speed} {letter}DAT{point} Tool[{tool}] Base[{base}];%{{PE}}%R 8.3.22,%MKUKATPBASIS,%CMOVE,%V{kind}",
        "$BWDSTART=FALSE",
        f"{letter}DAT_ACT={letter}{letter}DAT{point}",
        f"FDAT_ACT=FP{point}",
        f"BAS(#{group})",
        f"{kind} XP{point}{blend}",
        ";ENDFOLD",
    ]


def _condition(dice: random.Random) -> list[str]:
    return [f"IF {_again(dice, _TESTS)} THEN", *(f"  {line}" for line in _assignment(dice)), "ENDIF"]


def _assignment(dice: random.Random) -> list[str]:
    return [f"{dice.choice(('COUNT', 'STATE', 'OFFSET', '$OUT[12]', 'TABLE[3].X'))} = {_again(dice, _TERMS)} ; set"]


def _trigger(dice: random.Random) -> list[str]:
    delay = dice.randrange(-99, 99)
    return [f"TRIGGER WHEN DISTANCE={dice.randrange(2)} DELAY={delay} DO GUN({dice.randrange(9)},TRUE) PRIO=-1"]


def _wait(dice: random.Random) -> list[str]:
    return [f"WAIT FOR {_again(dice, _TESTS)}", f"WAIT SEC 0.{dice.randrange(1, 9)}"]


def _loop(dice: random.Random) -> list[str]:
    target = f"{{X {dice.uniform(-9, 9):.1f},Y {dice.uniform(-9, 9):.2f},Z 0,A 0,B 90,C 0}}"
    return [
        f"FOR COUNT=1 TO {dice.randrange(2, 50)}",
        f"  LIN_REL {target} C_DIS",
        f"  CALL{dice.randrange(9)}(COUNT,,#FAST)",
        "ENDFOR",
    ]


# one case
