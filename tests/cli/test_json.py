"""JSON on stdout: any value reads back, and each record of a list stands on a line of its own."""

from __future__ import annotations

import json

from hypothesis import given
from hypothesis import strategies as st

from respot.cli.outcome import json_text

plain = st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False, allow_infinity=False) | st.text()
values = st.recursive(plain, lambda inner: st.lists(inner) | st.dictionaries(st.text(), inner), max_leaves=60)


@given(values)
def test_what_is_written_reads_back(value):
    assert json.loads(json_text(value)) == value


def test_a_record_of_a_list_is_one_line():
    robot = {"name": "R1", "targets": [{"name": f"P{n}", "world": {"x": 1.0, "q": [1.0, 0.0]}} for n in range(3)]}
    lines = json_text({"robots": [robot]}).splitlines()
    assert (
        sum(line.strip().rstrip(",") == '{"name": "P1", "world": {"x": 1.0, "q": [1.0, 0.0]}}' for line in lines) == 1
    )
