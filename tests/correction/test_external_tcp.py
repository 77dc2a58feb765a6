"""The robot holds the part: targets are the gun's TCP seen from the part, and move by P' = D P (facts: krl.md 5, rapid.md 2.4).

SPOTS are the spots in the part frame; the calibration of `small` is the deviation D of that frame.
"""

from __future__ import annotations

import re

import numpy as np
import pytest

from tests.correction.small import DATA, SPOTS, TURN, convert, fdat, krl, krl_point, lin, moved, robtarget

GUN = "BASE_DATA[3]={X 2000.0,Y 100.0,Z 900.0,A 0.0,B 0.0,C 30.0}\n"


def krl_held_part(body: str = "", data: str = "", gun: str = GUN) -> dict[str, str]:
    """Backup that welds S1 to S4 of a held part (tool 1) at a fixed gun (base 3)."""
    files = krl()
    src = "DEF weld( )\n" + "".join(lin(name, weld=True) for name in SPOTS) + body + "END\n"
    points = "".join(krl_point(name, *place) + fdat(name, base=3, mode="#TCP") for name, place in SPOTS.items())
    config = files["KRC/R1/System/$config.dat"].replace("E6AXIS", gun + "E6AXIS")
    return {
        "KRC/R1/Program/weld.src": src,
        "KRC/R1/Program/weld.dat": "DEFDAT  WELD\n" + points + data + "ENDDAT\n",
        "KRC/R1/System/$config.dat": config,
    }


def krl_read(text: str, name: str) -> np.ndarray:
    numbers = re.search(rf"X{name}=\{{X (\S+?),Y (\S+?),Z (\S+?),A (\S+?),B (\S+?),C (\S+?)[,}}]", text)
    return np.array([float(number) for number in numbers.groups()])


def test_krl_targets_of_a_held_part_move_by_the_deviation_itself(tmp_path):
    done = convert(tmp_path, krl_held_part())
    assert done.code == 0, done.err
    text = done.text("weld.dat")
    for name, place in SPOTS.items():
        found = krl_read(text, name)
        assert found[:3] == pytest.approx(moved(place), abs=6e-4)
        assert found[3:] == pytest.approx([np.degrees(0.05), 0.0, 0.0], abs=6e-5)


def test_krl_neither_gun_nor_part_frame_matters_to_where_a_spot_is_on_the_part(tmp_path):
    other = GUN.replace("2000.0", "-350.0").replace("C 30.0", "C -80.0")
    first, second = convert(tmp_path / "a", krl_held_part()), convert(tmp_path / "b", krl_held_part(gun=other))
    assert first.text("weld.dat") == second.text("weld.dat")


def test_krl_a_via_point_of_the_held_part_moves_too(tmp_path):
    via = krl_point("VIA", 500, 50, 70) + fdat("VIA", base=3, mode="#TCP")
    done = convert(tmp_path, krl_held_part(body=lin("VIA"), data=via))
    assert krl_read(done.text("weld.dat"), "VIA")[:3] == pytest.approx(moved((500, 50, 70)), abs=6e-4)


def test_krl_picking_the_part_up_under_another_base_and_tool_stays(tmp_path):
    pick = krl_point("PICK", 5, 6, 7) + 'DECL FDAT FPICK={TOOL_NO 2,BASE_NO 5,IPO_FRAME #BASE,POINT2[] " "}\n'
    files = krl_held_part(body=lin("PICK"), data=pick)
    files["KRC/R1/System/$config.dat"] = files["KRC/R1/System/$config.dat"].replace(
        "BASE_DATA[1]=", "TOOL_DATA[2]={X 0.0,Y 50.0,Z 100.0,A 0.0,B 0.0,C 0.0}\nBASE_DATA[1]="
    )
    done = convert(tmp_path, files)
    assert done.code == 0, done.err
    assert done.stays()["XPICK"] == "OUT_OF_SCOPE"


def test_krl_the_same_frames_the_other_way_round_refuse_the_program(tmp_path):
    """krl.md 5: P0 #TCP but P20 #BASE with the same tool and base. Leaving one of them behind is a collision."""
    other = krl_point("P20", 5, 6, 7) + fdat("P20", base=3, mode="#BASE")
    done = convert(tmp_path, krl_held_part(body=lin("P20"), data=other))
    assert ("weld", "XP20", "EXTERNAL_TCP") in done.refusals()
    assert not done.edited()


def test_krl_a_held_gun_with_a_point_the_other_way_round_refuses_the_program(tmp_path):
    done = convert(tmp_path, krl(body=lin("P1"), data=krl_point("P1", 5, 6, 7) + fdat("P1", mode="#TCP")))
    assert done.refusals() == {("weld", "XP1", "EXTERNAL_TCP")}


@pytest.mark.parametrize("way", ["LIN_REL {Z 5.0} #BASE\n", "LIN_REL {Z 5.0} #TOOL\n", "CIRC_REL {Z 5.0},{X 5.0}\n"])
def test_krl_a_shift_along_a_fixed_gun_is_refused(tmp_path, way):
    done = convert(tmp_path, krl_held_part(body=way))
    assert {code for _, _, code in done.refusals()} == {"EXTERNAL_TCP"}
    assert not done.edited()


def test_krl_a_shift_along_the_tool_is_refused_where_nobody_knows_what_the_robot_holds(tmp_path):
    """Along a gun that it holds the way turns with its target, along a part it might not."""
    files = krl_held_part()
    files["KRC/R1/Program/weld.src"] = files["KRC/R1/Program/weld.src"].replace(
        "END\n", "Strange( )\nLIN_REL {Z 5.0} #TOOL\nEND\n"
    )
    done = convert(tmp_path, files)
    assert {code for _, _, code in done.refusals()} == {"UNKNOWN_MODE"}
    assert not done.edited()


def test_krl_a_point_used_both_ways_is_refused(tmp_path):
    body = "FDAT_ACT=FBOTH\nBAS(#CP_PARAMS,1)\nLIN XS1\n"
    both = 'DECL FDAT FBOTH={TOOL_NO 2,BASE_NO 5,IPO_FRAME #BASE,POINT2[] " "}\n'
    done = convert(tmp_path, krl_held_part(body=body, data=both))
    assert ("weld", "XS1", "SHARED_TARGET") in done.refusals()


def rapid_held_part(body: str = "", data: str = "") -> dict[str, str]:
    """Backup that welds S1 to S4 of a held part (wPart) at a fixed gun (tFixed)."""
    text = "MODULE Weld\n"
    text += "".join(f"  CONST robtarget {name}:={robtarget(*place)};\n" for name, place in SPOTS.items())
    text += data + "  PROC rWeld()\n"
    text += "".join(f"    SpotL {name},v800,gun1,sd1,tFixed\\WObj:=wPart;\n" for name in SPOTS) + body
    text += "  ENDPROC\nENDMODULE\n"
    return {"RAPID/TASK1/PROGMOD/Weld.mod": text, "RAPID/TASK1/SYSMOD/Frames.sys": DATA}


def rapid_read(text: str, name: str) -> np.ndarray:
    literal = re.search(rf"robtarget {name}:=(\[\[.*?\]\]);", text)[1]
    return np.array([float(number) for number in re.findall(r"[-+.\dE]+", literal)[:7]])


def test_rapid_targets_of_a_held_work_object_move_by_the_deviation_itself(tmp_path):
    done = convert(tmp_path, rapid_held_part(), "--keep-config")
    assert done.code == 0, done.err
    for name, place in SPOTS.items():
        found = rapid_read(done.text("Weld.mod"), name)
        assert found[:3] == pytest.approx(moved(place), abs=6e-4)
        assert found[3:] == pytest.approx([np.cos(0.025), 0, 0, np.sin(0.025)], abs=6e-8)


def test_rapid_offs_on_a_held_part_turns_with_it(tmp_path):
    done = convert(
        tmp_path, rapid_held_part(body="    MoveL Offs(S1,10,0,0),v100,z10,tFixed\\WObj:=wPart;\n"), "--keep-config"
    )
    assert done.code == 0, done.err
    numbers = re.search(r"Offs\(S1,([^,]+),([^,]+),([^)]+)\)", done.text("Weld.mod")).groups()
    assert [float(number) for number in numbers] == pytest.approx(TURN @ [10, 0, 0], abs=6e-4)


def test_rapid_held_part_with_the_gun_on_the_robot_is_no_motion(tmp_path):
    """A work object and a tool that are both held: the controller stops; nothing is guessed."""
    files = rapid_held_part()
    path = "RAPID/TASK1/PROGMOD/Weld.mod"
    files[path] = files[path].replace("tFixed", "tGun")
    done = convert(tmp_path, files, "--keep-config")
    assert done.code == 2
    assert "both held" in done.err
