"""Target, tool, work object, ID and weld of motions: one fixture for each trap of rapid.md 2, 3, 4 and 7.

Poses are worked out by hand. A point x, y, z of wTable lies at 1000 - y, x, 500 + z of the world.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from respot.languages.profile_file import read_profile
from respot.languages.rapid.calls import read_lines
from respot.languages.rapid.forms import FORMS, read_instruction
from respot.languages.rapid.robot import read_robots
from respot.program.moves import LabelKind, Motion
from tests.languages.rapid.conftest import read_text

DATA = Path(__file__).parents[2] / "data/rapid/binding"


def robot_of(*names: str, more: dict[str, str] | None = None, forms=FORMS):
    files = {"RAPID/TASK1/SYSMOD/frames.sys": (DATA / "frames.sys").read_bytes()}
    files |= {f"RAPID/TASK1/PROGMOD/{name}.mod": (DATA / f"{name}.mod").read_bytes() for name in names}
    files |= {path: text.encode() for path, text in (more or {}).items()}
    (robot,) = read_robots("r", "", files, forms)
    return robot


def moves_of(robot, routine: str = "main"):
    (found,) = [found for found in robot.routines if found.name == routine]
    return found.moves


def world(move) -> list[float]:
    return move.world.translation.tolist()


def codes(robot) -> list[str]:
    return [issue.code for issue in robot.issues if issue.code != "HALF_BACKUP"]


def module(body: str, data: str = "", name: str = "m") -> dict[str, str]:
    text = f"MODULE {name}\n{data}\n  PROC main()\n{body}\n  ENDPROC\nENDMODULE\n"
    return {f"RAPID/TASK1/PROGMOD/{name}.mod": text}


def test_inline_targets():
    joint, auxiliary, end, turned, configured = moves_of(robot_of("inline_targets"))
    assert (joint.motion, joint.target.name, joint.target.declared) == (Motion.JOINT, "MoveJ@3", False)
    assert world(joint) == pytest.approx([998, 1, 503])
    assert joint.world.apply([1, 0, 0]) - joint.world.translation == pytest.approx([0, 1, 0])
    assert (world(auxiliary), world(end), end.motion) == ([4, 5, 6], [7, 8, 9], Motion.CIRCULAR)
    assert end.base.world
    assert turned.codes == ("RUN_TIME_POSE",)
    assert turned.target.pose is None
    assert world(configured) == [1, 2, 3]
    assert "cf1" not in configured.target.numbers
    assert "cf1" in configured.target.fields


def test_numbers_of_a_target_are_those_of_its_text():
    text = "    MoveL [[1.50,-2e1, 3],[-1,0,0,0],[-1,0,1,0],[98.6,9E+09,9E9,9E9,9E9,9E9]],v1,z1,tGun;\n"
    robot = robot_of(more=module(text))
    (move,) = moves_of(robot)
    source = robot.files[move.path].source.text
    found = {name: (float(number.value), source[slice(*number.span)]) for name, number in move.target.numbers.items()}
    assert found["x"] == (1.5, "1.50")
    assert found["y"] == (-20.0, "-2e1")
    assert found["q1"] == (-1.0, "-1")
    assert found["cf1"] == (-1.0, "-1")
    assert found["eax_a"] == (98.6, "98.6")
    assert len(found) == 17


def test_offs_and_reltool():
    offset, shifted, computed, twice = moves_of(robot_of("offs_and_reltool"))
    assert [float(number.value) for number in offset.offset.numbers] == [1, 2, 3]
    assert world(shifted) == pytest.approx([980, 10, 480])  # 10, 20, 30 - 50
    x_of_tool = shifted.world.apply([1, 0, 0]) - shifted.world.translation
    assert x_of_tool == pytest.approx([-1, 0, 0])  # 90 degrees of wTable and 90 of Rz
    assert computed.tool_offset is None
    assert computed.world is None
    assert twice.codes == ("RUN_TIME_POSE",)
    assert offset.target is shifted.target is computed.target is twice.target


def test_turns_of_reltool_are_about_x_then_the_new_y_then_the_new_z():
    p1 = "[[0,0,0],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]"
    body = f"    MoveL RelTool({p1},0,0,0\\Rx:=90\\Ry:=90\\Rz:=90),v1,z1,tGun;\n"
    (move,) = moves_of(robot_of(more=module(body)))
    x = np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]])
    y = np.array([[0, 0, 1], [0, 1, 0], [-1, 0, 0]])
    z = np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1]])
    assert move.world.rotation.as_matrix() == pytest.approx(x @ y @ z, abs=1e-12)


def test_scopes():
    robot = robot_of("scopes", more=module("    MoveL p1,v1,z1,tGun;\n    MoveL p2,v1,z1,tGun;", name="n"))
    local, own = moves_of_module(robot, "m", "main")
    assert world(local) == pytest.approx([1000, 1, 500])
    assert world(own) == pytest.approx([1000, 3, 500])
    shared, nowhere, again = moves_of(robot, "other")
    assert world(shared) == pytest.approx([1000, 2, 500])
    assert nowhere.codes == ("UNKNOWN_TARGET", "UNKNOWN_FRAME", "UNKNOWN_TOOL")
    assert again.codes == ("UNKNOWN_TARGET",)
    hidden, seen = moves_of_module(robot, "n", "main")
    assert hidden.codes == ("UNKNOWN_TARGET",)
    assert world(seen) == [2, 0, 0]
    assert seen.target is shared.target


def moves_of_module(robot, program, routine):
    (found,) = [found for found in robot.routines if (found.program, found.name) == (program, routine)]
    return found.moves


def test_one_issue_for_each_cause_and_routine():
    robot = robot_of("scopes")
    unknown = [issue for issue in robot.issues if issue.code == "UNKNOWN_TARGET"]
    assert [(issue.line, "2 motions of other" in issue.message) for issue in unknown] == [(11, True)]


def test_records_and_arrays():
    robot = robot_of("records_and_arrays")
    first, second, grid, alias, chosen = moves_of(robot)
    assert [move.target.name for move in (first, second, grid, alias)] == [
        "dOne.at", "stAll{2}.first.at", "pGrid{2,1}", "plOne",
    ]  # fmt: skip
    assert [world(move)[1] for move in (first, second, grid, alias)] == pytest.approx([1, 3, 6, 8])
    assert chosen.target is None
    assert chosen.codes == ("RUN_TIME_POSE",)
    assert len(robot.targets) == 8  # what only looks like a robtarget is none


def test_an_undeclared_record_type_is_not_guessed():
    data = "  PERS strange st:=[[[1,2,3],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],5];"
    robot = robot_of(more=module("    MoveL st.at,v1,z1,tGun;", data))
    (move,) = moves_of(robot)
    assert move.target is None
    assert "strange" in move.unknown
    assert list(robot.targets) == []


def test_run_time_writes():
    robot = robot_of("run_time_writes")
    moves = moves_of(robot, "go")
    assert [move.codes for move in moves[:5]] == [("RUN_TIME_POSE",)] * 5
    assert [move.target.name for move in moves[:5]] == ["pSet", "pPart", "pCount", "pNamed", "pHanded"]
    still = moves[5]
    assert (still.codes, still.unknown) == ((), "")  # main assigns to a datum of its own that has the same name
    assert world(still) == pytest.approx([1000, 6, 500])
    assert (moves[6].target, moves[6].codes) == (None, ("RUN_TIME_POSE",))


def test_set_data_by_computed_name():
    picked, placed, fixed = moves_of(robot_of("set_data_by_computed_name"))
    assert "SetDataVal" in picked.unknown
    assert (placed.unknown, fixed.unknown) == ("", "")


def test_wrappers():
    moves = moves_of(robot_of("wrappers"))
    found = [(move.instruction, move.target.name, str(move.tool), str(move.base), move.unknown == "") for move in moves]
    assert found == [
        ("mvFixed", "p1", "tGun", "wTable", True),
        ("mvTwice", "p2", "tGun", "wTable", True),
        ("mvTwice", "p2", "tGun", "wobj0", True),
        ("mvBoth", "p1", "tGun", "wTable", True),
        ("mvBoth", "p1", "tGun", "wFloor", True),
        ("mvAbove", "p1", "tGun", "wTable", False),
        ("mvChanged", "p1", "tGun", "wTable", False),
        ("weldHere", "p2", "tGun", "wTable", True),
        ("weldHere", "p2", "tGun", "wTable", True),
        ("mvNamed", "p1", "tGun", "wTable", True),
        ("goHome", "pOwn", "tGun", "wTable", True),
    ]
    assert moves[0].motion is Motion.JOINT
    assert [move.weld for move in moves[7:9]] == [False, True]
    assert moves[8].spot_ids[0] == "432810"
    assert world(moves[7]) == pytest.approx([1000, 2, 480])
    assert world(moves[8]) == pytest.approx([1000, 2, 500])
    assert {move.line for move in moves} == {6, 7, 8, 9, 10, 11, 12, 13, 14, 15}


@given(
    place=st.tuples(*[st.integers(-2000, 2000)] * 3),
    depth=st.integers(0, 6),
    frames=st.sampled_from([("tGun", "\\WObj:=wTable"), ("tGun", ""), ("tStand", "\\WObj:=wPart")]),
)
def test_wrappers_within_wrappers_change_nothing(place, depth, frames):
    tool, wobj = frames
    chain = "".join(
        f"  PROC w{level}(robtarget p,PERS tooldata t\\PERS wobjdata WObj)\n"
        f"    {f'w{level - 1} p,t' if level else 'MoveL p,v1,z1,t'}\\WObj?WObj;\n  ENDPROC\n"
        for level in range(depth + 1)
    )
    target = f"[[{place[0]},{place[1]},{place[2]}],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]"
    body = f"    MoveL {target},v1,z1,{tool}{wobj};\n    w{depth} {target},{tool}{wobj};"
    direct, wrapped = moves_of(robot_of(more=module(body, chain)))
    assert wrapped.spot_pose.translation == pytest.approx(direct.spot_pose.translation)
    assert (wrapped.tool, wrapped.base, wrapped.external_tcp) == (direct.tool, direct.base, direct.external_tcp)
    assert wrapped.codes == direct.codes == ()


def test_a_wrapper_moves_nothing_where_it_stands():
    robot = robot_of("wrappers")
    wrappers = [found for found in robot.routines if found.name.startswith("mv") or found.name == "goHome"]
    assert [found.moves for found in wrappers] == [[]] * len(wrappers)


def test_a_wrapper_that_nobody_calls_keeps_its_own_target():
    routine = "  PROC goHome(PERS tooldata t)\n    MoveJ pOwn,v1,fine,t\\WObj:=wTable;\n  ENDPROC\n"
    data = "  CONST robtarget pOwn:=[[1,0,0],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];\n" + routine
    robot = robot_of(more=module("", data))
    (move,) = moves_of(robot, "goHome")
    assert (move.target.name, move.codes) == ("pOwn", ("UNKNOWN_TOOL",))


def test_an_offset_in_a_wrapper_is_one_literal_for_all_its_calls():
    data = "  CONST robtarget pOwn:=[[1,0,0],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];\n"
    data += "  PROC up(PERS tooldata t)\n    MoveJ Offs(pOwn,0,0,9),v1,fine,t\\WObj:=wTable;\n  ENDPROC\n"
    robot = robot_of(more=module("    up tGun;\n    up tGun;", data))
    assert [move.codes for move in moves_of(robot)] == [("RUN_TIME_POSE",)] * 2


def test_a_routine_that_calls_itself_ends():
    robot = robot_of("wrappers", more=module("    itself p1;", name="n"))
    moves = moves_of_module(robot, "n", "main")
    assert moves[0].unknown == ""
    assert "calls itself" in moves[1].unknown


def test_many_wrappers_within_wrappers_end():
    chain = "".join(f"  PROC w{n}(robtarget p)\n    w{n + 1} p;\n    w{n + 1} p;\n  ENDPROC\n" for n in range(60))
    robot = robot_of("scopes", more=module("    w0 p2;", chain, name="n"))
    assert moves_of_module(robot, "n", "main") == [] or all(m.unknown for m in moves_of_module(robot, "n", "main"))


def test_displacement():
    robot = robot_of("displacement")
    displaced = {
        name: [move.codes for move in moves_of(robot, name)]
        for name in ("main", "before", "within", "after", "maybe", "inLoop", "tStop")
    }
    on, off = [("DISPLACED",)], [()]
    # the loop leaves the displacement on, and main begins anew after its end
    assert displaced == {"main": off, "before": on, "within": on, "after": off, "maybe": on, "inLoop": on, "tStop": on}
    assert "PDispSet at RAPID/TASK1/PROGMOD/displacement.mod:6" in moves_of(robot, "within")[0].unknown


def test_a_displacement_that_is_switched_off_again_does_not_reach_what_runs_before_it():
    p1 = "[[1,0,0],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]"
    body = f"    MoveL {p1},v1,z1,tGun;\n    PDispSet pe;\n    MoveL {p1},v1,z1,tGun;\n    PDispOff;\n    MoveL {p1},v1,z1,tGun;"
    assert [move.codes for move in moves_of(robot_of(more=module(body)))] == [(), ("DISPLACED",), ()]


def test_stationary_gun():
    robot = robot_of("stationary_gun")
    spot, both_held, none_held, turning, changed, loaded = moves_of(robot)
    assert spot.external_tcp
    assert spot.world is None
    assert spot.spot_pose.translation == pytest.approx([11, 22, 33])  # in the part frame
    assert (spot.load.mass, spot.load.centre) == (40.0, (0.0, 0.0, 80.0))
    assert both_held.codes == none_held.codes == ("CONTRADICTING_FRAMES",)
    assert turning.codes == ("UNKNOWN_FRAME",)
    assert "STN1" in turning.base.unknown
    assert changed.external_tcp
    assert "wHeldChanged" in changed.unknown
    assert (loaded.load.mass, loaded.load.centre) == (12.0, (0.0, 5.0, 60.0))
    assert not loaded.external_tcp


def test_spot_dialects():
    moves = moves_of(robot_of("spot_dialects"))
    found = [(move.weld, move.spot_ids[0] if move.spot_ids else None) for move in moves]
    assert found == [
        (True, "31274"),  # a stray comma before an option
        (True, "12345"),  # spot data before the gun
        (True, "49"),
        (True, "432810"),  # \G1 of SpotML
        (True, "432810"),  # an inline target has no name
        (False, "p10"),  # a wrapper that is not in the backup, a number first
        (True, "17"),  # the weld is the next call, the ID stands in the comment above
        (False, "p10"),  # what does not weld is not named by a comment
    ]
    assert {str(move.tool) for move in moves} == {"tGun"}
    assert {str(move.base) for move in moves} == {"wTable"}
    labels = {label.kind: label.text for label in moves[6].labels}
    assert labels == {LabelKind.COMMENT: "Punto 17", LabelKind.ROUTINE: "main"}
    assert [label.text for label in moves[4].labels if label.kind is LabelKind.ARGUMENT] == ["432810"]


def test_late_binding():
    robot = robot_of("late_binding")
    (main,) = [found for found in robot.routines if found.name == "main"]
    assert main.calls == ["rStyle1", "rStyle2"]
    (handed,) = main.moves
    assert (handed.target.name, handed.codes) == ("p1", ("RUN_TIME_POSE",))
    assert codes(robot).count("LATE_BINDING") == 2


def test_globals_of_one_name_are_ambiguous():
    target = "  CONST robtarget pSame:=[[{},0,0],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];"
    files = module("    MoveL pSame,v1,z1,tGun;", target.format(1), name="a")
    files |= module("    MoveL pSame,v1,z1,tGun;", target.format(2), name="b")
    files |= module("    MoveL pSame,v1,z1,tGun;", name="c")
    robot = robot_of(more=files)
    assert [move.codes for move in robot.moves()] == [(), (), ("AMBIGUOUS_NAME",)]
    issues = [issue for issue in robot.issues if issue.code == "AMBIGUOUS_NAME" and "pSame" in issue.message]
    assert "a.mod:2" in issues[0].message
    assert "b.mod:2" in issues[0].message


def test_persistent_frames_without_a_value_take_it_from_another_task():
    data = "  PERS tooldata tGun;\n  PERS wobjdata wTable;\n  TASK PERS wobjdata wFloor;"
    target = "[[1,2,3],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]"
    body = f"    MoveL {target},v1,z1,tGun\\WObj:=wTable;\n    MoveL {target},v1,z1,tGun\\WObj:=wFloor;"
    files = {"RAPID/TASK2/PROGMOD/m.mod": module(body, data)["RAPID/TASK1/PROGMOD/m.mod"]}
    shared, own = robot_of(more=files).moves()
    assert world(shared) == pytest.approx([998, 1, 503])
    assert own.codes == ("UNKNOWN_FRAME",)


@pytest.mark.parametrize(
    ("arguments", "gun", "spot"),
    [
        ("wp1,v1,gun1,sd1,\\QuickRelease,tGun", "gun1", "sd1"),
        ("wp1,v1,sd1,gun1,tGun", "gun1", "sd1"),
        ("wp1,v1,gun1,sdNotHere,tGun", "gun1", "sdNotHere"),
        ("wp1,v1,a,b,tGun", None, None),
    ],
)
def test_gun_and_spot_data_are_told_by_their_types(arguments, gun, spot):
    (call,) = read_lines(read_text(f"SpotL {arguments}\\WObj:=w;"))[0].calls
    types = {"gun1": "gunnum", "sd1": "spotdata", "tGun": "tooldata"}
    fields = read_instruction(call, lambda node: types.get(node.text, ""))
    found = {name: field.text for name, field in fields.items()}
    assert (found.get("gun"), found.get("spot")) == (gun, spot)
    assert (found["target"], found["tool"], found["wobj"]) == ("wp1", "tGun", "w")
    edit = fields["tool"].edit("tNew")
    source = call.statement.text
    assert source[: edit.span[0]] + edit.replacement + source[edit.span[1] :] == source.replace("tGun", "tNew")


def test_a_plant_profile_names_its_wrapper(tmp_path):
    path = tmp_path / "plant.toml"
    path.write_text(
        'language = "rapid"\ntitle = "Our plant"\n[[wrapper]]\nname = "PointWeld"\nmotion = "linear"\nweld = true\n'
        'target = 2\ntool = "tGun"\nwobj = "wTable"\n[[spot_id]]\nin = "argument"\npattern = "^(\\\\d{4})$"\n'
    )
    body = "    PointWeld 4711,[[1,0,0],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v1;"
    (move,) = moves_of(robot_of(more=module(body), forms=FORMS.with_plant([read_profile(path)])))
    assert (move.weld, move.spot_ids[0], str(move.tool), str(move.base)) == (True, "4711", "tGun", "wTable")
    assert world(move) == pytest.approx([1000, 1, 500])
    (unknown,) = moves_of(robot_of(more=module(body)))
    assert (unknown.weld, unknown.codes) == (False, ("RUN_TIME_POSE",))


def test_the_counter_of_a_loop_hides_a_constant():
    data = """  CONST num i:=1;
  CONST num last:=2;
  CONST robtarget p{2}:=[[[1,0,0],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],
                         [[2,0,0],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]];"""
    body = """    FOR I FROM 1 TO 2 DO
      MoveL p{i},v100,fine,tool0;
    ENDFOR
    MoveL p{last},v100,fine,tool0;"""
    in_loop, after = moves_of(robot_of(more=module(body, data)))
    assert (in_loop.target, in_loop.codes) == (None, ("RUN_TIME_POSE",))
    assert (world(after), after.codes) == ([2, 0, 0], ())


def test_what_an_unread_statement_assigns_to_is_not_known():
    point = "[[%d,0,0],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]"
    wobj = '[FALSE,TRUE,"",[[0,0,0],[1,0,0,0]],[[0,0,0],[1,0,0,0]]]'
    data = "".join(f"  PERS robtarget p{number}:={point % number};\n" for number in (1, 2, 3))
    data += f"  PERS wobjdata wPart:={wobj};\n  PERS wobjdata wOther:={wobj};\n"
    body = """    p1.trans . x := 5 MM;
    p2 := p3 MM;
    wPart:=wOther wOther;
    Unknown \\wOther:=p3 5;
    MoveL p1,v100,fine,tool0;
    MoveL p2,v100,fine,tool0;
    MoveL p3,v100,fine,tool0\\WObj:=wPart;
    MoveL p3,v100,fine,tool0\\WObj:=wOther;"""
    found = moves_of(robot_of(more=module(body, data)))
    assert [move.codes for move in found] == [("RUN_TIME_POSE",), ("RUN_TIME_POSE",), ("UNKNOWN_FRAME",), ()]
