"""Files with a suffix of KRL that hold something else are left alone (facts: krl.md trap 15)."""

from __future__ import annotations

import pytest

from respot.languages.krl.syntax import looks_like_krl

FOREIGN = {
    "c++": "#include <iostream>\nint main() {\n  int a = 3;\n  foo(a);\n  return 0;\n}\n",
    "declarations of c": "int a;\nint b;\nint c;\n",
    "greyhack": 'if params.len != 1 then exit("usage")\nshell = get_shell\nif shell then\n  print("x")\nend if\n',
    "python": "def f(x):\n    return x\nprint(f(3))\n",
    "numbers": "1.0 2.0 3.0\n4.0 5.0 6.0\n",
    "ini": "[section]\na=1\nb=2\n",
    "settings": "a=1\nb=2\n",
    "namelist": "&input\n x=1,\n/\n",
    "xml": '<?xml version="1.0"?>\n<a b="c"/>\n',
    "prose": "This is a text about robots.\nIt has two lines.\n",
    "binary": "\x00\x01\x02MZ\x90\x00\x03",
    "assembler": "; comment\n mov ax, bx\n int 21h\n",
    "csv": "id,x,y,z\nP1,1,2,3\n",
    "measurements": "FARO 1.2\nP1 12.3 4.5 6.7\n",
}
KRL = {
    "program": "&ACCESS RVP\n; x\nDEF a ( )\nEND\n",
    "list": "DEFDAT a\nENDDAT\n",
    "function": "global deffct int f(a:in)\nendfct\n",
    "points without a list": "DECL E6POS P={X 1}\nE6POS Q={X 2}\n",
    "fragment": ";FOLD one\nA[1].B = 3\n;ENDFOLD\n",
    "motions": "PTP XP1\nLIN XP2\n",
    "header only": "&ACCESS RVP\n",
    "comments": "; nothing\n",
    "empty": "",
    "damaged head": "DEF a(\nPTP XP1\nLIN XP2\nEND\n",
    "damaged body": "DEF a()\n??\n!!\nEND\n",
}


@pytest.mark.parametrize("text", FOREIGN.values(), ids=FOREIGN)
def test_foreign(text):
    assert not looks_like_krl(text)


@pytest.mark.parametrize("text", KRL.values(), ids=KRL)
def test_krl(text):
    assert looks_like_krl(text)


def test_fixtures(program):
    assert looks_like_krl(program.read_bytes().decode("cp1252"))
