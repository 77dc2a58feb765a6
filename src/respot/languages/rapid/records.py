"""Record types of RobotWare: type and name of each of their fields (facts: rapid.md 2.1, 2.4)."""

from __future__ import annotations

from typing import TypeAlias

#: Type and name of each field, in order.
Fields: TypeAlias = tuple[tuple[str, str], ...]


def _fields(text: str) -> Fields:
    return tuple((kind, name) for kind, _, name in (part.partition(" ") for part in text.split(", ")))


#: Types of positions that a robot goes to. ``o_robtarget`` keeps the original of a modified position (rapid.md 2.4).
POSES = frozenset(("robtarget", "o_robtarget"))
JOINTS = frozenset(("jointtarget", "o_jointtarget"))
POSITIONS = POSES | JOINTS

BUILT_IN: dict[str, Fields] = {
    "pos": _fields("num x, num y, num z"),
    "orient": _fields("num q1, num q2, num q3, num q4"),
    "pose": _fields("pos trans, orient rot"),
    "confdata": _fields("num cf1, num cf4, num cf6, num cfx"),
    "extjoint": _fields("num eax_a, num eax_b, num eax_c, num eax_d, num eax_e, num eax_f"),
    "robjoint": _fields("num rax_1, num rax_2, num rax_3, num rax_4, num rax_5, num rax_6"),
    "robtarget": _fields("pos trans, orient rot, confdata robconf, extjoint extax"),
    "jointtarget": _fields("robjoint robax, extjoint extax"),
    "loaddata": _fields("num mass, pos cog, orient aom, num ix, num iy, num iz"),
    "tooldata": _fields("bool robhold, pose tframe, loaddata tload"),
    "wobjdata": _fields("bool robhold, bool ufprog, string ufmec, pose uframe, pose oframe"),
}
BUILT_IN["o_robtarget"], BUILT_IN["o_jointtarget"] = BUILT_IN["robtarget"], BUILT_IN["jointtarget"]
