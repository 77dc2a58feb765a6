"""Random RAPID backups and random edits of them, with what a comparison must find.

As `made_up_krl`, with what RAPID has of its own: targets in the code, targets of a routine, PERS that the program writes.
"""

from __future__ import annotations

import random
from dataclasses import dataclass, field, replace

import numpy as np

from tests.difference.made_up_krl import Expected, _fresh


@dataclass(frozen=True)
class Move:
    """A motion: to a declared target if it has a name, else to one in the code."""

    name: str
    position: tuple[float, ...]
    quaternion: tuple[float, ...]
    conf: int
    wobj: int
    tool: int
    instruction: str
    speed: str
    zone: str
    style: str = "{:.4f}"

    def literal(self) -> str:
        position = ",".join(self.style.format(v) for v in self.position)
        quaternion = ",".join(f"{v:.8f}" for v in self.quaternion)
        return f"[[{position}],[{quaternion}],[0,{self.conf},-1,0],[9E9,9E9,9E9,9E9,9E9,9E9]]"

    def code(self) -> str:
        target = self.name or self.literal()
        if self.instruction == "SpotL":
            return f"SpotL {target},{self.speed},gun1,sd_{self.conf + 5},tGun{self.tool}\\WObj:=wPart{self.wobj};"
        return f"{self.instruction} {target},{self.speed},{self.zone},tGun{self.tool}\\WObj:=wPart{self.wobj};"

    def data(self) -> list[str]:
        return [f"CONST robtarget {self.name}:={self.literal()};"] if self.name else []


@dataclass
class Module:
    name: str
    steps: list[Move | str]
    counter: int = 0
    comments: list[str] = field(default_factory=list)
    indent: str = "    "
    newline: str = "\r\n"
    comma: str = ""
    #: blanks that do not count, in the declaration of these
    upper: bool = False

    def files(self) -> dict[str, bytes]:
        lines = ["MODULE " + self.name, *(f"  {comment}" for comment in self.comments)]
        lines.append(f"  PERS num nCount_{self.name}:={self.counter};")
        seen = set()
        for step in self.steps:
            if isinstance(step, Move) and step.name and step.name not in seen:
                seen.add(step.name)
                lines += [f"  {line}" for line in step.data()]
        word = "PROC" if not self.upper else "proc"
        lines += ["", f"  {word} r{self.name}()", f"{self.indent}nCount_{self.name}:=nCount_{self.name}+1;"]
        for step in self.steps:
            text = step if isinstance(step, str) else step.code()
            lines.append(self.indent + text.replace("\\WObj", f"{self.comma}\\WObj"))
        lines += ["  ENDPROC", "ENDMODULE"]
        text = self.newline.join(lines) + self.newline
        return {f"RAPID/TASK1/PROGMOD/{self.name}.mod": text.encode("latin-1")}


@dataclass
class Robot:
    bases: dict[int, tuple[float, ...]]
    tools: dict[int, tuple[float, ...]]
    modules: list[Module]

    def files(self) -> dict[str, bytes]:
        lines = ["MODULE Frames(SYSMODULE)"]
        for n, (x, y, z, angle) in self.bases.items():
            half = np.radians(angle) / 2
            lines.append(
                f'  PERS wobjdata wPart{n}:=[FALSE,TRUE,"",[[{x:.3f},{y:.3f},{z:.3f}],[{np.cos(half):.9f},0,0,{np.sin(half):.9f}]],[[0,0,0],[1,0,0,0]]];'
            )
        for n, (x, y, z) in self.tools.items():
            lines.append(f"  PERS tooldata tGun{n}:=[TRUE,[[{x},{y},{z}],[1,0,0,0]],[80,[0,0,100],[1,0,0,0],0,0,0]];")
        found = {"RAPID/TASK1/SYSMOD/Frames.sys": ("\r\n".join([*lines, "ENDMODULE"]) + "\r\n").encode()}
        for module in self.modules:
            found.update(module.files())
        return found


def make(dice: random.Random) -> Robot:
    """Return a random backup."""
    bases = {n: (*np.round([dice.uniform(-900, 900) for _ in range(3)], 3), dice.randrange(-90, 90)) for n in (1, 2, 3)}
    tools = {n: (0.0, 0.0, 100.0 * n) for n in (1, 2)}
    modules = []
    for number in range(dice.randrange(1, 3)):
        steps: list[Move | str] = []
        for index in range(dice.randrange(14, 24)):
            steps.append(_move(dice, f"p{number}{index:02d}" if dice.random() < 0.6 else ""))
            if dice.random() < 0.7:
                steps.append(_logic(dice))
        modules.append(Module(f"Weld{number}", steps))
    return Robot(bases, tools, modules)


def _move(dice: random.Random, name: str) -> Move:
    position = tuple(round(dice.uniform(-900, 900), 4) for _ in range(3))
    quaternion = np.array([dice.uniform(-1, 1) for _ in range(4)])
    quaternion = tuple(np.round(quaternion / np.linalg.norm(quaternion), 8))
    return Move(
        name, position, quaternion, dice.randrange(-2, 2), dice.randrange(1, 4), dice.randrange(1, 3),
        dice.choice(("MoveL", "MoveJ", "SpotL")), dice.choice(("v200", "v500", "vmax")), dice.choice(("fine", "z10", "z50")),
    )  # fmt: skip


def _logic(dice: random.Random) -> str:
    return dice.choice(
        (
            f"SetDO do{_fresh()},1;",
            f"WaitDI di{_fresh()},1;",
            f"rGrip {_fresh()};",
            "WaitTime 0.5;",
            f"nState:={_fresh()};",
            f'TPWrite "at {_fresh()}";',
        )
    )


def _matrix(position, quaternion) -> np.ndarray:
    w, x, y, z = np.array(quaternion) / np.linalg.norm(quaternion)
    made = np.eye(4)
    made[:3, :3] = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    made[:3, 3] = position
    return made


class Edits:
    """Applies random edits to a copy of a backup and writes down what they are."""

    KINDS = (
        "shift",
        "frame",
        "tool",
        "rename",
        "logic",
        "speed",
        "zone",
        "insert",
        "delete",
        "add",
        "remove",
        "block",
        "noise",
        "confdata",
        "wobj",
        "instruction",
    )

    def __init__(self, old: Robot, dice: random.Random) -> None:
        self.dice = dice
        self.old = old
        self.new = Robot(
            dict(old.bases),
            dict(old.tools),
            [replace(m, steps=list(m.steps), comments=list(m.comments)) for m in old.modules],
        )
        self.expected = Expected()
        #: which old step each new step is, by identity of the new one
        self.origin: dict[int, tuple[Module, Move]] = {
            id(step): (module, step) for module in self.new.modules for step in module.steps if isinstance(step, Move)
        }
        self._touched: set[int] = set()
        self._keep: list[object] = []

    def run(self, count: int) -> None:
        kinds = [self.dice.choice(self.KINDS) for _ in range(count)]
        if "block" in kinds:
            kinds = [kind for kind in kinds if kind != "block"] + ["block"]
        for kind in kinds:
            getattr(self, kind)()
        self._world()

    def _free(self) -> tuple[Module, int] | None:
        module = self.dice.choice(self.new.modules)
        free = [i for i, s in enumerate(module.steps) if isinstance(s, Move) and id(s) not in self._touched]
        return (module, self.dice.choice(free)) if free else None

    def _replace(self, **changes) -> tuple[Move, Move] | None:
        found = self._free()
        if found is None:
            return None
        module, index = found
        old = module.steps[index]
        new = replace(old, **{name: value(old) if callable(value) else value for name, value in changes.items()})
        module.steps[index] = new
        self.origin[id(new)] = self.origin.pop(id(old))
        self._touched.add(id(new))
        self._keep += [old, new]
        return old, new

    def shift(self) -> None:
        way = [round(self.dice.choice((-1, 1)) * self.dice.uniform(0.05, 60), 4) for _ in range(3)]
        self._replace(position=lambda m: tuple(round(v + d, 4) for v, d in zip(m.position, way, strict=True)))

    def confdata(self) -> None:
        done = self._replace(conf=lambda m: m.conf + 3)
        if done is not None and done[0].instruction == "SpotL":  # the spot data follow it here
            self._code(done)

    def _code(self, done: tuple[Move, Move] | None) -> None:
        if done is not None:
            self.expected.gone.append(done[0].code())
            self.expected.come.append(done[1].code())

    def speed(self) -> None:
        self._code(self._replace(speed=lambda m: {"v200": "v300", "v500": "v600", "vmax": "v100"}[m.speed]))

    def zone(self) -> None:
        found = self._replace(zone=lambda m: {"fine": "z5", "z10": "z15", "z50": "z60"}[m.zone])
        if found is not None and found[0].instruction != "SpotL":
            self._code(found)

    def wobj(self) -> None:
        self._code(self._replace(wobj=lambda m: m.wobj % 3 + 1))

    def instruction(self) -> None:
        self._code(
            self._replace(
                instruction=lambda m: (
                    {"MoveL": "MoveJ", "MoveJ": "MoveL", "SpotL": "SpotJ"}[m.instruction]
                    if m.instruction != "SpotL"
                    else "SpotL"
                )
            )
        )
        if self.expected.gone and self.expected.gone[-1] == self.expected.come[-1]:
            self.expected.gone.pop()
            self.expected.come.pop()

    def frame(self) -> None:
        number = self.dice.randrange(1, 4)
        values = list(self.new.bases[number])
        values[self.dice.randrange(3)] += self.dice.choice((-7.5, 12.25))
        values[3] += self.dice.choice((0, 1))
        self.new.bases[number] = tuple(values)

    def tool(self) -> None:
        values = list(self.new.tools[1])
        values[2] += 1.5
        self.new.tools[1] = tuple(values)

    def rename(self) -> None:
        found = self._free()
        if found is None or not found[0].steps[found[1]].name:
            return
        module, index = found
        old = module.steps[index]
        new = replace(old, name=f"pNew{_fresh()}")
        module.steps[index] = new
        self.origin[id(new)] = self.origin.pop(id(old))
        self._touched.add(id(new))
        self._keep += [old, new]
        self.expected.renamed.add((old.name, new.name))

    def logic(self) -> None:
        module = self.dice.choice(self.new.modules)
        places = [
            i
            for i, s in enumerate(module.steps)
            if isinstance(s, str) and s.startswith(("SetDO", "rGrip", "nState")) and id(s) not in self._touched
        ]
        if places:
            place = self.dice.choice(places)
            old = module.steps[place]
            number = "".join(c for c in old.partition(",")[0] if c.isdigit())
            new = old.replace(number, str(_fresh()))
            module.steps[place] = new
            self._touched.add(id(new))
            self._keep += [old, new]
            self.expected.gone.append(old)
            self.expected.come.append(new)

    def insert(self) -> None:
        module = self.dice.choice(self.new.modules)
        line = f"Reset do{_fresh()};"
        module.steps.insert(self.dice.randrange(len(module.steps)), line)
        self._touched.add(id(line))
        self._keep.append(line)
        self.expected.come.append(line)

    def delete(self) -> None:
        module = self.dice.choice(self.new.modules)
        places = [i for i, s in enumerate(module.steps) if isinstance(s, str) and id(s) not in self._touched]
        if places:
            self.expected.gone.append(module.steps.pop(self.dice.choice(places)))

    def add(self) -> None:
        module = self.dice.choice(self.new.modules)
        move = _move(self.dice, f"pAdd{_fresh()}")
        module.steps.insert(self.dice.randrange(len(module.steps)), move)
        self._touched.add(id(move))
        self._keep.append(move)
        self.expected.added.add(move.name)
        self.expected.come.append(move.code())

    def remove(self) -> None:
        found = self._free()
        if found is None or not found[0].steps[found[1]].name:
            return
        move = found[0].steps.pop(found[1])
        self.origin.pop(id(move))
        self._keep.append(move)
        self.expected.removed.add(move.name)
        self.expected.gone.append(move.code())

    def block(self) -> None:
        module = self.dice.choice(self.new.modules)
        steps = module.steps
        plain = [id(s) not in self._touched and s != "WaitTime 0.5;" for s in steps]
        start = next((i for i in range(2, 5) if all(plain[i : i + 3])), None)
        if start is None or not all(plain[-6:]) or len(steps) < 16:
            return
        moved = steps[start : start + 3]
        del steps[start : start + 3]
        steps[len(steps) - 3 : len(steps) - 3] = moved
        self.expected.blocks += [s.code() if isinstance(s, Move) else s for s in moved]

    def noise(self) -> None:
        module = self.dice.choice(self.new.modules)
        choice = self.dice.choice(("drift", "spelling", "comments", "blanks", "line_ends", "comma", "case"))
        if choice == "drift":
            module.counter += 1
        elif choice == "spelling":
            found = self._replace(style="{:.5f}")
            if found is None:
                return
        elif choice == "comments":
            module.comments.append(f"! seen by {_fresh()}")
        elif choice == "blanks":
            module.indent += "  "
        elif choice == "comma":
            module.comma, choice = ",", "spelling"
        elif choice == "case":
            module.upper, choice = True, "spelling"
        else:
            module.newline = "\n"
        self.expected.noise.add(choice)

    def _world(self) -> None:
        for old, new, name in ((self.old.bases, self.new.bases, "wPart"), (self.old.tools, self.new.tools, "tGun")):
            self.expected.frames |= {f"{name}{n}" for n in old if old[n] != new[n]}
        for module in self.new.modules:
            line = (
                1 + len(module.comments) + 1 + len({s.name for s in module.steps if isinstance(s, Move) and s.name}) + 3
            )
            for number, step in enumerate(module.steps):
                if not isinstance(step, Move) or id(step) not in self.origin:
                    continue
                old = self.origin[id(step)][1]
                own = _matrix(old.position, old.quaternion), _matrix(step.position, step.quaternion)
                world = [
                    self._base(bases[m.wobj]) @ pose
                    for bases, m, pose in ((self.old.bases, old, own[0]), (self.new.bases, step, own[1]))
                ]
                if (
                    np.abs(own[1] - own[0]).max() > 1e-9
                    or np.abs(world[1] - world[0]).max() > 1e-8
                    or old.conf != step.conf
                ):
                    name = step.name or f"{step.instruction}@{line + number + 1}"
                    self.expected.moved[module.name.upper(), name] = (
                        (own[1] - own[0])[:3, 3],
                        (world[1] - world[0])[:3, 3],
                    )

    def _base(self, values) -> np.ndarray:
        half = np.radians(values[3]) / 2
        return _matrix(values[:3], (np.cos(half), 0, 0, np.sin(half)))
