"""`respot inspect`: what a person and a script see of a backup, a program and a table."""

from __future__ import annotations

import pytest

from tests.cli.conftest import SAMPLES


def by_name(result, robot: int = 0) -> dict[str, dict]:
    return {target["name"]: target for target in result.json["robots"][robot]["targets"]}


def test_a_tree_of_what_each_robot_holds(respot):
    result = respot("inspect", SAMPLES / "kuka")
    assert result.code == 0, result.err
    assert "ST140R01" in result.out
    assert "rear_door_u: 9 spots" in result.out
    assert "spots: 14" in result.out
    assert "2 without a motion" in result.out


def test_several_robots_in_one_tree(respot):
    result = respot("inspect", SAMPLES, "--json")
    assert [robot["language"] for robot in result.json["robots"]] == ["rapid", "krl"]
    only = respot("inspect", SAMPLES, "--robot-name", "st140r01", "--json")
    assert [robot["name"] for robot in only.json["robots"]] == ["ST140R01"]


@pytest.mark.parametrize("robot", ["kuka", "abb"])
def test_every_target_has_its_pose_its_frames_and_its_place(respot, robot):
    result = respot("inspect", SAMPLES / robot, "--json")
    for target in result.json["robots"][0]["targets"]:
        assert target["path"] and target["line"] > 0 and target["tool"] and target["base"]
        assert (target["joints"] is None) == (target["x"] is not None)
        if target["joints"] is None:
            assert target["world"] is not None and target["doubt"] is None


KRL = {
    "KRC/R1/System/$config.dat": (
        "DEFDAT $CONFIG\n"
        "TOOL_DATA[1]={X 0.0,Y 0.0,Z 100.0,A 0.0,B 0.0,C 0.0}\n"
        "BASE_DATA[1]={X 1000.0,Y 0.0,Z 500.0,A 90.0,B 0.0,C 0.0}\n"
        "ENDDAT\n"
    ),
    "KRC/R1/Program/a.dat": (
        "DEFDAT A\n"
        "DECL E6POS XS1={X 10.0,Y 20.0,Z 30.0,A -90.0,B 0.0,C 0.0,S 2,T 3,E1 44.5,E2 0.0,E3 0.0,E4 0.0,E5 0.0,E6 0.0}\n"
        'DECL FDAT FS1={TOOL_NO 1,BASE_NO 1,IPO_FRAME #BASE,POINT2[] " "}\n'
        "DECL E6POS XS2={X 1.0,Y 2.0,Z 3.0,A 0.0,B 0.0,C 0.0}\n"
        'DECL FDAT FS2={TOOL_NO 1,BASE_NO 1,IPO_FRAME #TCP,POINT2[] " "}\n'
        "ENDDAT\n"
    ),
    "KRC/R1/Program/a.src": (
        "DEF a( )\n"
        "FDAT_ACT=FS1\nBAS(#PTP_PARAMS,100)\nPTP XS1\nUSERSPOT(#SPOT,S_ACT)\n"
        "FDAT_ACT=FS2\nBAS(#CP_PARAMS,1)\nLIN XS2\n"
        "LIN XNOWHERE\n"
        "END\n"
    ),
}


@pytest.fixture
def krl(tmp_path):
    for path, text in KRL.items():
        (tmp_path / "b" / path).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / "b" / path).write_bytes(text.encode())
    return tmp_path / "b"


def test_a_target_in_its_base_and_in_the_world(respot, krl):
    """Base at (1000, 0, 500), turned by 90 degrees about z: (10, 20, 30) is (1000 - 20, 10, 530), A -90 + 90 = 0."""
    target = by_name(respot("inspect", krl, "--json"))["XS1"]
    assert [target[name] for name in "xyzabc"] == pytest.approx([10, 20, 30, -90, 0, 0])
    assert [target["world"][name] for name in "xyz"] == pytest.approx([980, 10, 530])
    assert target["world"]["q"] == pytest.approx([1, 0, 0, 0])
    assert target["q"] == pytest.approx([0.5**0.5, 0, 0, -(0.5**0.5)])
    assert (target["weld"], target["spot_id"], target["kind"]) == (True, "S1", "joint")
    assert (target["status"], target["turn"], target["external_axes"]["e1"]) == (2, 3, 44.5)
    assert target["declared"] == {"path": "KRC/R1/Program/a.dat", "line": 2}


def test_a_target_of_an_external_tcp_is_in_the_part(respot, krl):
    target = by_name(respot("inspect", krl, "--json"))["XS2"]
    assert target["external_tcp"] and target["world"] is None
    assert target["part"] == {"x": 1.0, "y": 2.0, "z": 3.0, "q": pytest.approx([1, 0, 0, 0])}


def test_a_motion_to_nobody_knows_where_is_listed(respot, krl):
    result = respot("inspect", krl, "--json")
    (lost,) = result.json["robots"][0]["unresolved"]
    assert (lost["path"], lost["line"]) == ("KRC/R1/Program/a.src", 9)
    assert "XNOWHERE" in lost["reason"]
    assert "1 motion whose goal the program computes or does not tell" in respot("inspect", krl).out


def test_the_spot_id_of_an_option_is_searched_in_the_whole_name(respot, krl):
    result = respot("inspect", krl, "--json", "--spot-id", r"^X(S\d)$")
    assert {name: target["spot_id"] for name, target in by_name(result).items()} == {"XS1": "S1", "XS2": None}


def test_spots_of_the_other_frame_are_left_out_and_said(respot, krl):
    result = respot("inspect", krl, "--json", "--spot-id", r"^X(S\d)$")
    assert "EXTERNAL_TCP" in {issue["code"] for issue in result.json["issues"]}


def test_a_plants_own_profile(respot, krl, tmp_path):
    profile = tmp_path / "plant.toml"
    profile.write_text(
        'language = "krl"\ntitle = "our plant"\n'
        '[[weld_call]]\nname = "ZAP"\n'
        "[[spot_id]]\nin = 'name'\npattern = '^XS(\\d+)$'\n"
    )
    (krl / "KRC/R1/Program/a.src").write_text(KRL["KRC/R1/Program/a.src"].replace("USERSPOT(#SPOT,S_ACT)", "ZAP(1)"))
    assert not by_name(respot("inspect", krl, "--json"))["XS1"]["weld"]
    target = by_name(respot("inspect", krl, "--json", "--profile", profile))["XS1"]
    assert (target["weld"], target["spot_id"]) == (True, "1")


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("language = 'krl'", "needs a text title"),
        ("language = 'fanuc'\ntitle = 'x'", "must be one of krl, rapid"),
        ("language = 'krl'\ntitle = 'x'\nservice = []", "unknown key service"),
        ("language = 'krl'\ntitle = 'x'\nhome = ['(']", "no regular expression"),
        ("language = 'krl'\ntitle = 'x'\n[[spot_id]]\nin = 'name'\npattern = 'X'", "needs a group"),
        ("language = 'krl'\ntitle = 'x'\n[[spot_id]]\nin = 'nose'\npattern = '(X)'", "must be one of name"),
        ("language = ", "is no TOML"),
    ],
)
def test_a_profile_that_cannot_be_used(respot, krl, tmp_path, text, says):
    (tmp_path / "p.toml").write_text(text)
    result = respot("inspect", krl, "--profile", "p.toml")
    assert result.code == 2
    assert "p.toml" in result.err and says in result.err and "BAD_PROFILE" in result.err


def test_a_table(respot):
    result = respot("inspect", SAMPLES / "theory.csv", "--json")
    spots = result.json["table"]["spots"]
    assert (len(spots), spots[0]["id"]) == (14, "P02WP1615438")
    assert [spots[0][name] for name in "xyz"] == [4324.31, 28.43, 1276.51]
    assert "spots: 14" in respot("inspect", SAMPLES / "theory.csv").out


def test_what_is_not_sure_has_no_place_in_the_world_and_a_mark(respot, krl):
    """The point is declared with numbers, but the program computes it before it goes there."""
    source = krl / "KRC/R1/Program/a.src"
    source.write_text(KRL["KRC/R1/Program/a.src"].replace("PTP XS1", "XS1=$POS_ACT\nPTP XS1"))
    target = by_name(respot("inspect", krl, "--json"))["XS1"]
    assert target["world"] is None and target["codes"] == ["RUN_TIME_POSE"] and "assigned" in target["doubt"]
    assert "XS1 (?)" in respot("inspect", krl).out


def test_a_shift_on_top_of_a_target_is_said_and_is_in_the_world(respot, krl):
    """(10, 20, 30) at A -90 under a base at A 90: the tool's axes are those of the world."""
    source = krl / "KRC/R1/Program/a.src"
    shifted = "PTP XS1:{X 1,Y 2,Z 3,A 0,B 0,C 0}"
    source.write_text(KRL["KRC/R1/Program/a.src"].replace("PTP XS1", shifted))
    target = by_name(respot("inspect", krl, "--json"))["XS1"]
    assert [target[name] for name in "xyz"] == pytest.approx([10, 20, 30])
    assert [target["world"][name] for name in "xyz"] == pytest.approx([981, 12, 533])
    assert [target["offset"]["tool"][name] for name in "xyz"] == [1, 2, 3]


def test_a_relative_motion_is_listed(respot, krl):
    source = krl / "KRC/R1/Program/a.src"
    source.write_text(KRL["KRC/R1/Program/a.src"].replace("LIN XNOWHERE", "LIN_REL {Z 5.0} #BASE"))
    (motion,) = respot("inspect", krl, "--json").json["robots"][0]["relative"]
    assert (motion["line"], motion["offset"]) == (9, {"base": [0, 0, 5], "tool": None})


def test_status_and_turn_as_bits(respot, krl):
    """krl.md 1: 'B010' is a number; many backups write S and T so."""
    data = krl / "KRC/R1/Program/a.dat"
    data.write_text(KRL["KRC/R1/Program/a.dat"].replace("S 2,T 3", "S 'B010',T 'B000011'"))
    target = by_name(respot("inspect", krl, "--json"))["XS1"]
    assert (target["status"], target["turn"]) == (2, 3)
