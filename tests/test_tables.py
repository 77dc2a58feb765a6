"""Spot tables in the spellings that people send."""

from __future__ import annotations

import numpy as np
import pytest

from respot.tables import read_table

WANTED = [[4324.31, -28.43, 1276.51], [4322.7, 98.41, 1276.5]]


@pytest.mark.parametrize(
    "text",
    [
        "id,x,y,z\nS1,4324.31,-28.43,1276.51\nS2,4322.7,98.41,1276.5\n",
        "ID;X;Y;Z\r\nS1;4324,31;-28,43;1276,51\r\nS2;4322,7;98,41;1276,5\r\n",
        "Name\tPos X [mm]\tPos Y [mm]\tPos Z [mm]\nS1\t4324.31\t-28.43\t1276.51\nS2\t4322.7\t98.41\t1276.5",
        "\n\nspot_id , x , y , z , station\n S1 , 4324.31 , -28.43 , 1276.51 , 140\nS2,4322.7,98.41,1276.5,\n\n",
        '"Class","ExternalId","X","Y","Z"\n"PmWeldPoint","S1","4324.31","-28.43","1276.51"\n"PmWeldPoint","S2","4322.7","98.41","1276.5"\n',
        "z,y,x,Punkt\n1276.51,-28.43,4324.31,S1\n1276.5,98.41,4322.7,S2\n",
    ],
    ids=["plain", "german", "tabs_and_units", "blanks_and_a_covariate", "quoted", "other_order"],
)
@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "latin-1"])
def test_spellings(tmp_path, text, encoding):
    (tmp_path / "t.csv").write_bytes(text.encode(encoding))
    table = read_table(tmp_path / "t.csv")
    assert list(table.ids) == ["S1", "S2"]
    assert np.array_equal(table.positions, WANTED)


def test_covariates_are_kept_as_text(tmp_path):
    (tmp_path / "t.csv").write_text("id,x,y,z,Station,time_min\nS1,0,0,0,140,1.5\n")
    table = read_table(tmp_path / "t.csv")
    assert (table.columns["station"], table.columns["time_min"]) == (["140"], ["1.5"])


@pytest.mark.parametrize(
    ("header", "cells"), [("a,b,c", "90,0,0"), ("q1,q2,q3,q4", "0.7071068,0,0,0.7071068"), ("rz,ry,rx", "90,0,0")]
)
def test_orientations(tmp_path, header, cells):
    (tmp_path / "t.csv").write_text(f"id,x,y,z,{header}\nS1,0,0,0,{cells}\n")
    rotation = read_table(tmp_path / "t.csv").rotations
    assert rotation[0].apply([1, 0, 0]) == pytest.approx([0, 1, 0], abs=1e-6)
