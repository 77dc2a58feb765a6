"""What is RAPID, and what only has a module's suffix."""

from __future__ import annotations

import pytest

from respot.languages.rapid.recognition import looks_like_rapid, recognise

RAPID = [
    "MODULE m\nENDMODULE\n",
    "%%%\nVERSION:1\nLANGUAGE:ENGLISH\n%%%\n\nMODULE Über(SYSMODULE)\nENDMODULE",
    "\ufeffMODULE m\nENDMODULE",
    "MODULE m ! c\r\n  garbage = 1\r\nENDMODULE\r\n",
    "MODULE m\n  VAR num a;\n  PROC p()\n  ENDPROC\n",
    "PROC main()\n  MoveL p1,v100,z10,tGun;\nENDPROC\n",
    "  CONST robtarget p1:=[[1,2,3],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];\n",
    "MoveL p1,v100,fine,tool0;\n",
    "SpotL p1,vmax,gun1,sd1,tool1;\n! c\n",
    "IF a=1 THEN\n  b:=2;\nENDIF\n",
    "MODULE m\rVAR num a;\rENDMODULE\r",
    "VAR num a;\n" * 5_000,
]
OTHER = [
    "",
    "\n\n",
    "\0" * 100,
    "MODULE Hello;\nIMPORT Out;\nVAR x: INTEGER;\nBEGIN\n  Out.String('hi');\nEND Hello.\n",
    "module github.com/a/b\n\ngo 1.20\n\nrequire (\n\tc.d/e v1.0.0\n)\n",
    "module a\n\ngo 1.21\n",
    "module fortran\n  implicit none\n  integer :: i\ncontains\n  subroutine s()\n  end subroutine\nend module\n",
    "set A;\nparam n;\nvar x{A} >= 0;\nminimize cost: sum{i in A} x[i];\nsubject to c: x[1] <= 3;\n",
    "SET TALK OFF\nUSE customers\nDO WHILE .NOT. EOF()\nSKIP\nENDDO\n",
    "MZ\x90\x00\x03\x00\x00\x00\x04",
    "M.K.!\x00\x01\x02",
    '<?xml version="1.0" encoding="ISO-8859-1" ?>\n<Program>\n  <Module>X.mod</Module>\n</Program>\n',
    "<<<<<<< HEAD\nnothing\n=======\n",
    "The quick brown fox; jumps over the lazy dog.\n",
    "int main(void) {\n  return 0;\n}\n",
]


@pytest.mark.parametrize("text", RAPID)
def test_rapid(text: str) -> None:
    assert recognise(text.encode("utf-8")) == "rapid"
    assert looks_like_rapid(text)
    assert looks_like_rapid(text.encode("latin-1", "replace")) or "\ufeff" in text


@pytest.mark.parametrize("text", OTHER)
def test_other(text: str) -> None:
    assert recognise(text.encode("latin-1")) == "other"
    assert not looks_like_rapid(text)


@pytest.mark.parametrize("first", [0xFC, 0xFD, 0xFE])
def test_encoded_module(first: int) -> None:
    data = bytes([first, 0x80, 0xE0, 0x5F, 0x6F, 0x01]) + bytes(range(256)) * 8
    assert recognise(data) == "binary"
    assert not looks_like_rapid(data)


def test_utf16_is_not_rapid() -> None:
    assert recognise("MODULE m\nENDMODULE\n".encode("utf-16")) == "other"
