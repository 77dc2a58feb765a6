"""Random KRL backups and random edits of them, with what a comparison must find.

Text is made here, line by line, and edited here; nothing is shared with what reads or compares it.
"""

from __future__ import annotations

import random
from dataclasses import dataclass, field, replace

import numpy as np


@dataclass(frozen=True)
class Point:
    """A taught point with its inline form."""

    name: str
    values: tuple[float, ...]
    status: int
    turn: int
    base: int
    tool: int
    linear: bool
    speed: float
    approximate: bool
    note: str = ""

    def fold(self) -> list[str]:
        kind, group, unit = ("LIN", "CP", "m/s") if self.linear else ("PTP", "PTP", "%")
        letter = "L" if self.linear else "P"
        continued = " CONT" if self.approximate else ""
        zone = " C_DIS" if self.approximate else ""
        return [
            f";FOLD {kind} {self.name}{continued} Vel={self.speed:g} {unit} {letter}{self.name} Tool[{self.tool}] Base[{self.base}];%{{PE}}%R 8.3.22,%MKUKATPBASIS,%CMOVE,%V{kind}",
            "$BWDSTART=FALSE",
            f"{letter}DAT_ACT={letter}{letter}{self.name}",
            f"FDAT_ACT=F{self.name}",
            f"BAS(#{group}_PARAMS,{self.speed:g})",
            f"{kind} X{self.name}{zone}",
            ";ENDFOLD",
        ]

    def code(self) -> list[str]:
        return [line for line in self.fold() if not line.startswith(";")]

    def pose_line(self, spelled: str = "{:.4f}") -> str:
        numbers = ",".join(f"{axis} {spelled.format(value)}" for axis, value in zip("XYZABC", self.values, strict=True))
        return f"DECL E6POS X{self.name}={{{numbers},S {self.status},T {self.turn},E1 0.0,E2 0.0,E3 0.0,E4 0.0,E5 0.0,E6 0.0}}"

    def data(self) -> list[str]:
        letter = "L" if self.linear else "P"
        # written with a number of its own, so that only the name can tell which is whose
        motion = f"VEL {self.speed + 1:g},ACC 100.0,APO_DIST {50 + self.turn}.0"
        return [
            f'DECL FDAT F{self.name}={{TOOL_NO {self.tool},BASE_NO {self.base},IPO_FRAME #BASE,POINT2[] " "}}',
            f"DECL {letter}DAT {letter}{letter}{self.name}={{{motion}}}",
        ]


@dataclass
class Module:
    """A .src with its .dat."""

    name: str
    steps: list[Point | str]
    rel: int = 1
    last: str = "P1"
    comments: list[str] = field(default_factory=list)
    spelled: dict[str, str] = field(default_factory=dict)
    indent: str = ""
    newline: str = "\r\n"
    blank_after: int = 0
    counter: int = 0

    @property
    def points(self) -> list[Point]:
        found: dict[str, Point] = {}
        for step in self.steps:
            if isinstance(step, Point):
                found.setdefault(step.name, step)
        return list(found.values())

    def files(self) -> dict[str, bytes]:
        source = ["&ACCESS RVP", f"&REL {self.rel}", f"DEF {self.name}( )", *self.comments, "INI_ALL( )"]
        for number, step in enumerate(self.steps):
            lines = [step] if isinstance(step, str) else step.fold()
            source += [self.indent + line for line in lines]
            if self.blank_after and number % self.blank_after == 0:
                source.append("")
        data = ["&ACCESS RVP", f"&REL {self.rel}", f"DEFDAT {self.name}"]
        data.append(f'DECL BASIS_SUGG_T LAST_BASIS={{POINT1[] "{self.last}",POINT2[] "{self.last}"}}')
        data.append(f"DECL INT COUNT_{self.name}={self.counter}")
        for point in self.points:
            data += [point.pose_line(self.spelled.get(point.name, "{:.4f}")), *point.data()]
        texts = {"src": [*source, "END"], "dat": [*data, "ENDDAT"]}
        return {
            f"KRC/R1/Program/{self.name.lower()}.{suffix}": (self.newline.join(lines) + self.newline).encode("cp1252")
            for suffix, lines in texts.items()
        }


@dataclass
class Robot:
    """A backup: frames and modules."""

    bases: dict[int, tuple[float, ...]]
    tools: dict[int, tuple[float, ...]]
    modules: list[Module]

    def files(self) -> dict[str, bytes]:
        lines = ["DEFDAT $CONFIG"]
        for kind, frames in (("TOOL", self.tools), ("BASE", self.bases)):
            for number, values in frames.items():
                numbers = ",".join(f"{axis} {value:.3f}" for axis, value in zip("XYZABC", values, strict=True))
                lines.append(f"{kind}_DATA[{number}]={{{numbers}}}")
        found = {"KRC/R1/System/$config.dat": ("\r\n".join([*lines, "ENDDAT"]) + "\r\n").encode()}
        for module in self.modules:
            found.update(module.files())
        return found


@dataclass
class Expected:
    """What a comparison must list: nothing more, nothing less."""

    moved: dict[tuple[str, str], tuple[np.ndarray, np.ndarray]] = field(default_factory=dict)
    frames: set[str] = field(default_factory=set)
    added: set[str] = field(default_factory=set)
    removed: set[str] = field(default_factory=set)
    renamed: set[tuple[str, str]] = field(default_factory=set)
    gone: list[str] = field(default_factory=list)
    come: list[str] = field(default_factory=list)
    blocks: list[str] = field(default_factory=list)
    noise: set[str] = field(default_factory=set)


def matrix(values) -> np.ndarray:
    """4x4 of X, Y, Z, A, B, C: R = Rz(A) Ry(B) Rx(C)."""
    x, y, z, a, b, c = values
    ca, sa, cb, sb, cc, sc = (f(np.radians(v)) for v in (a, b, c) for f in (np.cos, np.sin))
    made = np.eye(4)
    made[:3, :3] = (
        np.array([[ca, -sa, 0], [sa, ca, 0], [0, 0, 1]])
        @ np.array([[cb, 0, sb], [0, 1, 0], [-sb, 0, cb]])
        @ np.array([[1, 0, 0], [0, cc, -sc], [0, sc, cc]])
    )
    made[:3, 3] = x, y, z
    return made


def make(dice: random.Random) -> Robot:
    """Return a random backup."""
    bases = {
        n: (*np.round([dice.uniform(-900, 900) for _ in range(3)], 3), dice.randrange(-90, 90), 0.0, 0.0)
        for n in (1, 2, 3)
    }
    tools = {n: (0.0, 0.0, 100.0 * n, 0.0, 0.0, 0.0) for n in (1, 2)}
    modules = []
    for number in range(dice.randrange(1, 3)):
        steps: list[Point | str] = []
        for index in range(dice.randrange(14, 24)):
            steps.append(_point(dice, f"P{number}{index:02d}"))
            if dice.random() < 0.7:
                steps.append(_logic(dice))
        modules.append(Module(f"WELD{number}", steps, rel=dice.randrange(1, 99)))
    return Robot(bases, tools, modules)


def _point(dice: random.Random, name: str) -> Point:
    values = tuple(round(dice.uniform(-900, 900), 4) for _ in range(3)) + tuple(
        round(dice.uniform(-80, 80), 4) for _ in range(3)
    )
    linear = dice.random() < 0.5
    speed = dice.choice((0.5, 1, 2)) if linear else dice.choice((30, 60, 100))
    return Point(
        name,
        values,
        2,
        dice.randrange(64),
        dice.randrange(1, 4),
        dice.randrange(1, 3),
        linear,
        speed,
        dice.random() < 0.5,
    )


_COUNT = [1000]


def _fresh() -> int:
    _COUNT[0] += 1
    return _COUNT[0]


def _logic(dice: random.Random) -> str:
    return dice.choice(
        (
            f"$OUT[{_fresh()}]=TRUE",
            f"WAIT FOR $IN[{_fresh()}]",
            f"GRIP({_fresh()},TRUE)",
            "WAIT SEC 0.5",
            f"COUNTER={_fresh()}",
            f"PULSE($OUT[{_fresh()}],TRUE,0.5)",
        )
    )


class Edits:
    """Applies random edits to a copy of a backup and writes down what they are."""

    def __init__(self, old: Robot, dice: random.Random) -> None:
        self.dice = dice
        self.old = old
        self.new = Robot(
            dict(old.bases),
            dict(old.tools),
            [replace(m, steps=list(m.steps), comments=list(m.comments), spelled=dict(m.spelled)) for m in old.modules],
        )
        self.expected = Expected()
        self._touched: set[tuple[str, str]] = set()
        self._renamed: dict[tuple[str, str], str] = {}
        self._added: set[tuple[str, str]] = set()

    KINDS = (
        "shift",
        "frame",
        "tool",
        "rename",
        "logic",
        "speed",
        "insert",
        "delete",
        "add",
        "remove",
        "block",
        "noise",
        "status",
        "base_number",
        "zone",
    )

    def run(self, count: int) -> None:
        kinds = [self.dice.choice(self.KINDS) for _ in range(count)]
        if "block" in kinds:  # a block must stay whole: it is moved last
            kinds = [kind for kind in kinds if kind != "block"] + ["block"]
        for kind in kinds:
            getattr(self, kind)()
        self._world()

    def _free(self) -> tuple[Module, int] | None:
        module = self.dice.choice(self.new.modules)
        free = [
            i for i, s in enumerate(module.steps) if isinstance(s, Point) and (module.name, s.name) not in self._touched
        ]
        if not free:
            return None
        index = self.dice.choice(free)
        self._touched.add((module.name, module.steps[index].name))
        return module, index

    def _replace(self, **changes) -> tuple[Point, Point] | None:
        found = self._free()
        if found is None:
            return None
        module, index = found
        old = module.steps[index]
        made = {name: value(old) if callable(value) else value for name, value in changes.items()}
        module.steps[index] = replace(old, **made)
        return old, module.steps[index]

    def shift(self) -> None:
        way = [round(self.dice.choice((-1, 1)) * self.dice.uniform(0.05, 60), 4) for _ in range(3)]
        turn = self.dice.choice((0.0, 1.25))
        self._replace(
            values=lambda p: tuple(round(v + d, 4) for v, d in zip(p.values, [*way, turn, 0, 0], strict=True))
        )

    def status(self) -> None:
        self._replace(turn=lambda p: p.turn ^ 1)  # APO_DIST of its motion data follows it here
        # the generator writes the turn into the motion data as well: that line changes too
        self._data_lines()

    def _data_lines(self) -> None:
        """Nothing here: `_world` compares the data lines of every point that stayed."""

    def frame(self) -> None:
        number = self.dice.randrange(1, 4)
        values = list(self.new.bases[number])
        values[self.dice.randrange(3)] += self.dice.choice((-7.5, 12.25))
        if self.dice.random() < 0.5:
            values[3] += 0.5
        self.new.bases[number] = tuple(values)

    def tool(self) -> None:
        number = self.dice.randrange(1, 3)
        values = list(self.new.tools[number])
        values[2] += 1.5
        self.new.tools[number] = tuple(values)

    def rename(self) -> None:
        done = self._replace(name=f"R{_fresh()}")
        if done is None:
            return
        letter = "LL" if done[0].linear else "PP"
        for prefix in ("X", "F", letter):
            self.expected.renamed.add((prefix + done[0].name, prefix + done[1].name))
        module = next(m.name for m in self.new.modules if done[1] in m.steps)
        self._renamed[module, done[0].name] = done[1].name
        self._touched.add((module, done[1].name))

    def speed(self) -> None:
        done = self._replace(speed=lambda p: p.speed * 2 + 1)
        if done is not None:
            old, new = (f"BAS(#{'CP' if p.linear else 'PTP'}_PARAMS,{p.speed:g})" for p in done)
            self.expected.gone.append(old)
            self.expected.come.append(new)

    def zone(self) -> None:
        done = self._replace(approximate=lambda p: not p.approximate)
        if done is not None:
            self.expected.gone.append(done[0].code()[-1])
            self.expected.come.append(done[1].code()[-1])

    def base_number(self) -> None:
        self._replace(base=lambda p: p.base % 3 + 1)

    def logic(self) -> None:
        module = self.dice.choice(self.new.modules)
        places = [
            i
            for i, s in enumerate(module.steps)
            if isinstance(s, str)
            and s.startswith(("$OUT", "GRIP", "COUNTER"))
            and (module.name, s) not in self._touched
        ]
        if places:
            place = self.dice.choice(places)
            old = module.steps[place]
            number = "".join(c for c in old if c.isdigit())
            new = old.replace(number, str(_fresh()))
            module.steps[place] = new
            self._touched.add((module.name, new))
            self.expected.gone.append(old)
            self.expected.come.append(new)

    def insert(self) -> None:
        module = self.dice.choice(self.new.modules)
        line = f"$OUT[{_fresh()}]=FALSE"
        module.steps.insert(self.dice.randrange(len(module.steps)), line)
        self._touched.add((module.name, line))
        self.expected.come.append(line)

    def delete(self) -> None:
        module = self.dice.choice(self.new.modules)
        places = [i for i, s in enumerate(module.steps) if isinstance(s, str) and (module.name, s) not in self._touched]
        if places:
            self.expected.gone.append(module.steps.pop(self.dice.choice(places)))

    def add(self) -> None:
        module = self.dice.choice(self.new.modules)
        point = _point(self.dice, f"N{_fresh()}")
        module.steps.insert(self.dice.randrange(len(module.steps)), point)
        self._touched.add((module.name, point.name))
        self._added.add((module.name, point.name))
        self.expected.added.add(f"X{point.name}")
        self.expected.come += [*point.code(), *point.data()]

    def remove(self) -> None:
        found = self._free()
        if found is not None:
            module, index = found
            point = module.steps.pop(index)
            self.expected.removed.add(f"X{point.name}")
            self.expected.gone += [*point.code(), *point.data()]

    def block(self) -> None:
        module = self.dice.choice(self.new.modules)
        points = [i for i, s in enumerate(module.steps) if isinstance(s, Point)]
        if len(points) < 12 or self._blocked(module):
            return
        # two folds from near the beginning go near the end: less moves than stays
        start = next((i for i in points[:4] if self._plain(module, i) and self._plain(module, i + 1)), None)
        if start is None:
            return
        moved = module.steps[start : start + 2]
        del module.steps[start : start + 2]
        module.steps[len(module.steps) - 3 : len(module.steps) - 3] = moved
        for step in moved:
            self.expected.blocks += step.code() if isinstance(step, Point) else [step]

    def _blocked(self, module: Module) -> bool:
        return any(not self._plain(module, i) for i in range(len(module.steps) - 6, len(module.steps)))

    def _plain(self, module: Module, index: int) -> bool:
        step = module.steps[index]
        key = step.name if isinstance(step, Point) else step
        return (module.name, key) not in self._touched and step != "WAIT SEC 0.5"

    def noise(self) -> None:
        module = self.dice.choice(self.new.modules)
        choice = self.dice.choice(("header", "last_used", "spelling", "comments", "blanks", "line_ends", "empty"))
        if choice == "header":
            module.rel += 1
        elif choice == "last_used":
            module.last = f"P{_fresh()}"
        elif choice == "spelling":
            point = next((p for p in module.points if (module.name, p.name) not in self._touched), None)
            if point is None:
                return
            self._touched.add((module.name, point.name))
            module.spelled[point.name] = "{:.5f}"
        elif choice == "comments":
            module.comments.append(f"; seen by {_fresh()}")
        elif choice == "blanks":
            module.indent += "  "
        elif choice == "empty":
            module.blank_after += 3
            choice = "blanks"
        else:
            module.newline = "\n"
        self.expected.noise.add(choice)

    def _world(self) -> None:
        """Write down which points are elsewhere, as programmed or in the world, and which data lines differ."""
        for kind, old, new in (("BASE", self.old.bases, self.new.bases), ("TOOL", self.old.tools, self.new.tools)):
            self.expected.frames |= {f"{kind}_DATA[{number}]" for number in old if old[number] != new[number]}
        for before, after in zip(self.old.modules, self.new.modules, strict=True):
            now = {point.name: point for point in after.points}
            for point in before.points:
                name = self._renamed.get((before.name, point.name), point.name)
                if name not in now:
                    continue
                new = now[name]
                own = matrix(point.values), matrix(new.values)
                world = [
                    matrix(bases[p.base]) @ pose
                    for bases, p, pose in ((self.old.bases, point, own[0]), (self.new.bases, new, own[1]))
                ]
                if (
                    np.abs(own[1] - own[0]).max() > 1e-9
                    or np.abs(world[1] - world[0]).max() > 1e-9
                    or point.turn != new.turn
                ):
                    self.expected.moved[after.name, f"X{name}"] = (
                        (own[1] - own[0])[:3, 3],
                        (world[1] - world[0])[:3, 3],
                    )
                for old_line, new_line in zip(replace(point, name=name).data(), new.data(), strict=True):
                    if old_line != new_line:
                        renamed = replace(point, name=point.name).data()[point_line(old_line)]
                        self.expected.gone.append(renamed)
                        self.expected.come.append(new_line)


def point_line(line: str) -> int:
    return 0 if line.startswith("DECL FDAT") else 1
