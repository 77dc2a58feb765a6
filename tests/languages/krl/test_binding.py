"""Tool, base, load and mode of each motion, a fixture for each trap (facts: krl.md sections 5, 6 and 10)."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from respot.program.moves import LabelKind
from tests.languages.krl.binding import base, by_name, issues, moves, read, tool, world

# BASE_DATA[1]: origin 1000, 0, 500, turned by 90 degrees about z: (x, y, z) lies at (1000 - y, x, 500 + z)
# BASE_DATA[2]: origin 0, 200, 0, turned by 180 degrees about x: (x, y, z) lies at (x, 200 - y, -z)
IN_1, IN_2 = [980, 10, 530], [10, 180, -30]  # of X 10, Y 20, Z 30
_FRAME = "{X 1.0,Y 0.0,Z 0.0,A 0.0,B 0.0,C 0.0}"
_CONFIG = "DEFDAT  $CONFIG\nDECL FRAME TOOL_DATA[4]\nDECL FRAME BASE_DATA[4]\n"
_CONFIG += "".join(f"{kind}_DATA[{n}]={_FRAME}\n" for kind in ("TOOL", "BASE") for n in range(1, 5)) + "ENDDAT\n"


def test_frame_data_as_variable_literal_element_and_changed_member():
    found = by_name("fdat_forms")
    assert [(name, tool(move), base(move)) for name, move in found.items()] == [
        ("XP1", "TOOL_DATA[2]", "BASE_DATA[2]"),
        ("XP2", "TOOL_DATA[1]", "BASE_DATA[2]"),
        ("XP3", "TOOL_DATA[2]", "BASE_DATA[1]"),
        ("XP4", None, None),
        ("XP5", "TOOL_DATA[1]", None),
        ("XP6", "TOOL_DATA[2]", "BASE_DATA[1]"),  # BAS leaves FDAT_ACT as it is
    ]
    assert world(found["XP2"]) == IN_2
    assert found["XP4"].codes == ("UNKNOWN_FRAME", "UNKNOWN_TOOL")
    assert found["XP5"].codes == ("UNKNOWN_FRAME",)


def test_commands_of_bas():
    found = by_name("bas_commands")
    assert [(tool(move), base(move)) for move in found.values()] == [
        ("TOOL_DATA[1]", "$WORLD"),  # what INITMOV of this bas.src sets
        ("TOOL_DATA[2]", "BASE_DATA[2]"),
        ("TOOL_DATA[2]", "BASE_DATA[1]"),  # BAS(#BASE,NUMBER), a number that nobody changes
        ("TOOL_DATA[2]", None),
        ("TOOL_DATA[2]", "EX_BASE"),
    ]
    assert [move.codes for move in found.values()] == [(), (), (), ("UNKNOWN_FRAME",), ("UNKNOWN_FRAME",)]
    assert found["XP1"].base.world


def test_initmov_of_an_unknown_version_leaves_the_tool_unknown():
    # KSS 5.4 to 8.6 set TOOL_DATA[1], but the backup does not say so
    first = moves("bas_commands", bas__src="DEF other( )\nEND\n")[0]
    assert tool(first) is None
    assert first.codes == ("UNKNOWN_TOOL",)


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("XP1", [15, 180, -30]),  # BASE_DATA[2]:OFFSET, 5 along x
        ("XP2", [10, 20, 30]),
        ("XP3", [10, 20, 30]),
        ("XP4", [11, 22, 33]),
        ("XP5", [80, 10, 30]),  # BASE1: origin 100, 0, 0, turned by 90 degrees
        ("XP6", [80, 10, 35]),
        ("XP7", [80, 11, 35]),  # 1 along x of the base before
        ("XP8", None),
        ("XP9", None),
        ("XP10", None),
        ("XP11", None),
        ("XP12", IN_2),
        ("XP13", None),
        ("XP14", None),
    ],
)
def test_what_base_is_set_to(name, expected):
    move = by_name("frame_expressions")[name]
    assert world(move) == expected
    assert "UNKNOWN_FRAME" in move.codes if expected is None else move.codes == ()


def test_a_spline_sets_frames_for_its_block_and_its_elements():
    found = by_name("spline_with_lists")
    assert [base(move) for move in found.values()] == [
        *("BASE_DATA[1]", "BASE_DATA[2]", "BASE_DATA[1]", "BASE_DATA[2]"),
        *("BASE_DATA[1]", "BASE_DATA[2]", "BASE_DATA[1]"),
    ]
    assert [tool(move) for move in found.values()] == [f"TOOL_DATA[{number}]" for number in (1, 2, 2, 2, 1, 2, 1)]
    assert {str(move.load) for move in found.values()} == {"LOAD_DATA[1]", "LOAD_DATA[2]"}
    assert world(found["XP4"]) == IN_2


def test_bases_on_other_kinematics_move():
    found = by_name("moving_bases")
    assert [move.codes for move in found.values()] == [(), (), ("UNKNOWN_FRAME",), ("UNKNOWN_FRAME",)]
    assert world(found["XP2"]) == IN_2  # its kinematic is the robot itself


def test_corrections_that_are_switched_on():
    (move,) = moves("corrections_switched_on")
    assert move.codes == ("UNKNOWN_FRAME", "UNKNOWN_TOOL")
    assert "M_BAS_COR_ON" in move.base.unknown
    assert "TOOL_CORR_W_ON" in move.tool.unknown


def test_corrections_that_are_only_switched_off_change_nothing():
    # bas.src of every backup does this
    (move,) = moves("corrections_switched_off")
    assert (move.codes, world(move)) == ((), IN_1)


def test_numbers_beyond_config():
    robot = read("numbers_beyond_config")
    first, second = robot.moves()
    assert first.codes == second.codes == ("UNKNOWN_FRAME", "UNKNOWN_TOOL")
    assert "no more than BASE_DATA[32]" in first.base.unknown
    assert "no more than TOOL_DATA[16]" in first.tool.unknown
    assert "is not in the backup" in second.base.unknown
    assert [line for code, _, line in issues(robot) if code == "UNKNOWN_FRAME"] == [5, 8]


# ---------------------------------------------------------------------------------------------------- external TCP


def flange(move):
    """Flange in the world, by matrices: base P tool^-1, or with an external TCP base P^-1 part^-1."""
    inverse = np.linalg.inv
    target, held, fixed = move.target.pose.as_matrix(), move.tool.pose.as_matrix(), move.base.pose.as_matrix()
    return fixed @ (inverse(target) if move.external_tcp else target) @ inverse(held)


def test_the_external_tcp_twin_is_the_inverse_of_its_point():
    found = by_name("external_tcp_twin")
    held, external = found["XP9"], found["XP11"]
    assert (held.external_tcp, external.external_tcp) == (False, True)
    assert [tool(move) for move in found.values()] == ["TOOL_DATA[1]"] * 2
    assert [base(move) for move in found.values()] == ["BASE_DATA[1]"] * 2
    assert held.codes == external.codes == ()
    assert world(held) == [950, 100, 300]
    assert external.world is None
    assert external.workpiece is external.tool
    np.testing.assert_allclose(external.spot_pose.translation, [-100, 50, -200])  # in the part, which the tool is
    # the tool of 300 mm points down at 950, 100, 300
    expected = [[0, 1, 0, 950], [1, 0, 0, 100], [0, 0, -1, 600], [0, 0, 0, 1]]
    np.testing.assert_allclose(flange(held), expected, atol=1e-9)
    np.testing.assert_allclose(flange(external), expected, atol=1e-9)


angles = st.floats(-180, 180)
lengths = st.floats(-2000, 2000)


@given(xyz=st.tuples(lengths, lengths, lengths), abc=st.tuples(angles, st.floats(-89, 89), angles))
def test_any_point_and_its_inverse_with_external_tcp_are_one_flange(xyz, abc):
    rotation = Rotation.from_euler("ZYX", abc, degrees=True)
    back = [*(-rotation.inv().apply(xyz)), *rotation.inv().as_euler("ZYX", degrees=True)]
    text = "".join(
        f"DECL E6POS {name}={{{','.join(f'{key} {value:.9f}' for key, value in zip('XYZABC', values, strict=True))}}}\n"
        for name, values in (("XP9", [*xyz, *abc]), ("XP11", back))
    )
    frames = "".join(
        f"DECL FDAT {name}={{TOOL_NO 2,BASE_NO 2,IPO_FRAME {mode}}}\n"
        for name, mode in (("FP9", "#BASE"), ("FP11", "#TCP"))
    )
    first, second = moves("external_tcp_twin", weld__dat=f"DEFDAT WELD\n{text}{frames}ENDDAT\n")
    np.testing.assert_allclose(flange(first), flange(second), atol=1e-5)


def test_a_mode_that_is_not_known_is_said():
    found = by_name("mode_not_known")
    assert [move.external_tcp for move in found.values()] == [False, True, False, False, False]
    assert [move.codes for move in found.values()] == [(), (), ("UNKNOWN_MODE",), (), ("UNKNOWN_MODE",)]
    assert found["XP3"].unknown and found["XP5"].unknown
    assert "OUTSIDE is not in this backup" in found["XP5"].unknown


def test_a_mode_that_contradicts_the_type_of_its_base_is_said_once():
    robot = read("mode_contradicts_type")
    assert [move.codes for move in robot.moves()] == [("MODE_CONTRADICTS",), (), ("MODE_CONTRADICTS",)]
    assert [found for found in issues(robot) if found[0] == "MODE_CONTRADICTS"] == [("MODE_CONTRADICTS", "weld.src", 5)]


def test_loads():
    found = by_name("loads")
    assert [str(move.load) for move in list(found.values())[:2]] == ["LOAD_DATA[1]", "LOAD_DATA[2]"]
    assert [None if move.load is None else move.load.mass for move in found.values()] == [120, None, 7.5, 120, None]
    assert found["XP1"].load.centre == (10, 20, 150)
    assert "default load" in found["XP2"].load.unknown  # M -1 means $DEF_L_M
    assert found["XP5"].load is None


def test_the_default_load_is_that_of_the_robot():
    (move,) = moves("default_load")
    assert (move.load.mass, move.load.centre) == (210, (0, 0, 250))


# --------------------------------------------------------------------------------------------------- control flow


def test_subprograms_find_and_leave_frames():
    found = by_name("subprograms")
    assert {name: base(move) for name, move in found.items()} == {
        "XP1": "BASE_DATA[1]",  # its only caller sets it
        "XP2": "BASE_DATA[2]",  # TO_BASE2 left it
        "XP3": None,  # its callers set different ones
        "XP4": None,  # MAYBE may return before it sets one
        "XP5": None,  # calls itself
        "XP6": None,  # GLOBAL: anybody may call it
    }
    assert {name: tool(move) for name, move in found.items() if tool(move)} == dict.fromkeys(
        ("XP1", "XP2", "XP3", "XP4"), "TOOL_DATA[1]"
    )
    assert "differently" in found["XP3"].doubts[0].text


def test_interrupts_set_frames_at_a_time_of_their_own():
    found = by_name("interrupts_and_triggers")
    assert {name: base(move) for name, move in found.items()} == {
        "XP1": "BASE_DATA[1]",
        "XP2": "BASE_DATA[1]",
        "XP3": None,
        "XP4": "BASE_DATA[2]",
    }
    assert {name: tool(move) for name, move in found.items()} == {
        **dict.fromkeys(("XP1", "XP2", "XP3"), "TOOL_DATA[1]"),
        "XP4": None,
    }


def test_a_loop_may_have_set_it_otherwise():
    found = by_name("loops")
    assert {name: base(move) for name, move in found.items()} == {
        "XP1": None,
        "XP2": "BASE_DATA[1]",
        "XP3": "BASE_DATA[1]",
    }
    assert {tool(move) for move in found.values()} == {"TOOL_DATA[1]"}


def test_a_branch_in_a_loop_sets_what_the_loop_finds():
    body = "$BASE=BASE_DATA[1]\nLOOP\nLIN XP1\nIF A THEN\nIF B THEN\n$BASE=BASE_DATA[2]\nENDIF\nENDIF\nENDLOOP\n"
    (move,) = moves("loops", weld__src=f"DEF weld( )\n{body}END\n")
    assert base(move) is None


def test_a_condition_runs_before_its_loop():
    body = "$BASE=BASE_DATA[1]\nWHILE TESTED()\nLIN XP1\nENDWHILE\nLIN XP2\n"
    tested = "DEFFCT BOOL TESTED()\n$BASE=BASE_DATA[2]\nRETURN TRUE\nENDFCT\n"
    first, second = moves("loops", weld__src=f"DEF weld( )\n{body}END\n{tested}")
    assert base(first) == base(second) == "BASE_DATA[2]"


def test_a_call_that_is_not_understood_may_set_frames_and_bring_others():
    found = by_name("unread_call")
    assert {name: base(move) for name, move in found.items()} == {"XP1": "BASE_DATA[1]", "XP2": None, "XP3": None}
    assert "line 8" in found["XP3"].doubts[0].text


# ------------------------------------------------------------------------------------------------------- operands


def test_operands():
    found = moves("operands")
    names = [str(move.target) for move in found]
    assert names[:5] == ["XP1", "XP2", "XP3", "XP3", "None"]  # both points of a CIRC are targets
    np.testing.assert_allclose(found[2].world.translation, [980, 10, 470])  # 60 back along the tool
    # XP3 is turned by 90 degrees in a base turned by 90: its x points along -x of the world
    np.testing.assert_allclose(found[3].world.translation, [975, 10, 530])
    assert found[4].codes == ("RUN_TIME_POSE",)  # OFFSET:XP3
    assert [move.codes for move in found[5:10]] == [()] * 5
    assert [move.offset is not None for move in found[5:10]] == [False, False, False, True, False]
    assert world(found[10]) == [998, 1, 503]
    assert found[11].target is found[2].target
    assert found[11].world is None  # shifted by what the program measured
    assert found[11].codes == ("RUN_TIME_SHIFT",)
    assert found[12].target.kind == "joints"
    assert found[2].target is found[3].target
    np.testing.assert_allclose(found[13].world.translation, [980, 5, 530])  # turned first, then 5 along the new x


# --------------------------------------------------------------------------------------------------------- labels


def texts(move, kind):
    return [label.text for label in move.labels if label.kind is kind]


def test_labels_stand_where_a_spot_id_may():
    swp, spot, plain = by_name("labels").values()
    assert texts(swp, LabelKind.NAME) == ["XP1"]
    assert texts(swp, LabelKind.TITLE) == ["Swp Spotpoint LIN TypeId:22 SpotNo:30623 GunNo:1"]
    assert texts(swp, LabelKind.PARAMS) == ["Params IlfProvider=swp; Swp_SpotNo=30623; Swp_TypeId=22"]
    assert texts(swp, LabelKind.COMMENT) == ["inner comment", "first comment", "behind it"]
    assert texts(swp, LabelKind.ARGUMENT) == ["1,22,30623"]
    assert texts(swp, LabelKind.ROUTINE) == ["weld"]
    assert texts(spot, LabelKind.DATA) == ["SDAT7"]
    assert texts(spot, LabelKind.ARGUMENT) == [
        "#SPOT,S_ACT",
        "GUN 1,PAIR #FIRST,RETR #OPN,CLO_TM 0,PGNO1 12,PRESS1 2.5",
    ]
    assert (swp.weld, spot.weld, plain.weld) == (True, True, False)
    assert texts(plain, LabelKind.TITLE) == ["Station 5"]
    assert texts(plain, LabelKind.COMMENT) == []  # the comment above the fold is that of its first motion


def test_a_weld_call_above_the_motion_of_its_form_welds_neither():
    found = by_name("weld_call_above_the_motion")
    assert {name: move.weld for name, move in found.items()} == {"XP1": False, "XP2": False, "XP3": True}
    assert texts(found["XP3"], LabelKind.ARGUMENT) == ["1,22,6"]


def test_frames_of_vkrc_are_not_known():
    # nobody documents what VW(#MPARA) does with P2_D; the title alone tells
    (move,) = moves("vkrc_form")
    assert move.codes == ("UNKNOWN_FRAME", "UNKNOWN_TOOL")
    assert "RobWzg=1 Base=0" in texts(move, LabelKind.TITLE)[0]


def test_the_spot_of_vkrc_is_in_a_fold_below_the_motion():
    (move,) = moves("vkrc_form")
    assert move.weld
    assert move.spot_ids[0] == "10067"


# ------------------------------------------------------------------------------------------- what code may have changed


def test_the_counter_of_a_loop_has_not_the_value_of_its_declaration():
    in_loop, after = moves("loop_counter_of_the_data_list")
    assert (in_loop.target, in_loop.codes) == (None, ("RUN_TIME_POSE",))
    assert (str(after.target), after.codes) == ("XA[1]", ())


def test_what_an_unread_statement_assigns_to_is_not_known():
    found = by_name("assigned_by_an_unread_statement")
    assert {name: move.codes for name, move in found.items()} == {
        "XP1": ("RUN_TIME_POSE",),
        "XP2": ("RUN_TIME_POSE",),
        "XP3": (),  # compared, and only on the right
        "XA[1]": ("RUN_TIME_POSE",),
    }


def test_positions_of_the_system():
    found = moves("system_positions")
    # where the robot is or was, or its home: these follow the robot
    assert [(move.target, move.unknown) for move in found[:5]] == [(None, "")] * 5
    origin, product, root, none = found[5:]
    assert (origin.target, origin.codes) == (None, ("UNKNOWN_TARGET",))
    assert "origin of the base" in origin.unknown
    assert (product.target, product.codes) == (None, ("RUN_TIME_POSE",))
    assert product.unknown.startswith("$NULLFRAME:XP1 starts from $NULLFRAME")
    assert (root.target, root.codes) == (None, ("RUN_TIME_POSE",))
    assert (none.target, none.codes) == (None, ("RUN_TIME_POSE",))


def test_torque_monitoring_leaves_frames_alone():
    # tm_bib.src of KSS 8.3 writes FHOME.TQ_STATE
    first, second = moves("torque_state_written")
    assert (base(first), first.codes) == ("BASE_DATA[1]", ())
    assert (base(second), second.codes) == (None, ("UNKNOWN_FRAME", "UNKNOWN_TOOL"))


def test_a_constant_tells_which_frame_is_written():
    robot = read("frames_written_by_constants", **{"$config__dat": _CONFIG})
    assert [frame.unknown for frame in robot.bases] == ["", "", "the program assigns to it", ""]
    # a name of the routine's own hides the constant
    assert {frame.unknown for frame in robot.tools} == {"the program assigns to it"}


def test_a_number_that_code_changes_may_be_any():
    more = {"$config__dat": _CONFIG, "weld__src": "DEF weld( )\nSET_LATER=2\nBASE_DATA[SET_LATER]=$NULLFRAME\nEND\n"}
    robot = read("frames_written_by_constants", **more)
    assert {frame.unknown for frame in robot.bases} == {"the program assigns to it"}
