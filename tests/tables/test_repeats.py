"""The same spot measured several times: told apart by a column it is one spot, otherwise it is refused."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from respot.calibration.repeats import noise_from_repeats, noise_of_table
from respot.issues import BadInputError
from respot.tables import read_table

HEAD = "id;run;x;y;z"


def read(folder, text, name="t.csv", **options):
    (folder / name).write_text(text, encoding="utf-8")
    return read_table(folder / name, **options)


def test_rows_of_a_spot_become_their_mean(tmp_path):
    table = read(tmp_path, f"{HEAD}\nA;1;1;2;3\nB;1;10;0;0\na;2;2;4;3\nA;3;3;6;9\n")
    assert list(table.ids) == ["A", "B"]
    np.testing.assert_allclose(table.positions, [[2, 4, 5], [10, 0, 0]])
    assert list(table.lines) == [2, 3]
    every = table.repeats
    assert every is not None
    assert (list(every.columns), list(every.ids), list(every.lines)) == (["run"], ["A", "B", "A", "A"], [2, 3, 4, 5])
    np.testing.assert_allclose(every.positions, [[1, 2, 3], [10, 0, 0], [2, 4, 3], [3, 6, 9]])
    said = [issue for issue in table.issues if "told apart" in issue.message]
    assert [issue.code for issue in said] == ["TABLE_COLUMNS"]
    assert "1 of 2 spots stand in it up to 3 times, told apart by its column 'run'" in said[0].message
    assert "A 4.58 mm" in said[0].message  # (1, 2, 4) from the mean


@pytest.mark.parametrize(
    "title",
    ["repeat", "Repeat", "REPEAT NO.", "repetition", "run", "Run #", "run_no", "measurement", "Measurement number"]
    + ["shot", "Shots", "Wiederholung", "Wiederholungs-Nr", "Messung", "MESSUNG NR.", "Messungsnr", "Durchlauf"],
)
@pytest.mark.parametrize("marks", [("1", "2"), ("first", "second"), ("2024-05-01 10:00", "2024-05-01 10:05")])
def test_titles_and_marks(tmp_path, title, marks):
    table = read(tmp_path, f"id;{title};x;y;z\nA;{marks[0]};1;2;3\nA;{marks[1]};3;2;3\nB;{marks[0]};5;5;5\n")
    np.testing.assert_allclose(table.positions, [[2, 2, 3], [5, 5, 5]])


@pytest.mark.parametrize(
    ("text", "what"),
    [
        (
            "id;x;y;z\nA;1;2;3\nA;1;2;4\n",
            "positions 1.00 mm apart.*repeats of one spot are numbered in a column repeat",
        ),
        ("id;station;x;y;z\nA;1;1;2;3\nA;2;1;2;4\n", "positions 1.00 mm apart"),
        (f"{HEAD}\nA;1;1;2;3\nA;1;1;2;4\n", "here and in line 2 with positions 1.00 mm apart"),
        (f"{HEAD}\nA;1;1;2;3\nA;2;1;2;4\nA;2;1;2;4\n", "here and in line 3 with the same position"),
        (f"{HEAD}\nA;;1;2;3\nA;2;1;2;4\n", "here and in line 2"),
        (f"{HEAD}\nA;1;1;2;3\nA;;1;2;4\n", "here and in line 2"),
        (f"{HEAD}\nA;1;1;2;3\nA;2;1;2;303\n", "150.0 mm from the mean of its 2 rows: these are no repeats of one spot"),
    ],
    ids=["no_column", "another_column", "same_run", "run_twice", "no_first_mark", "no_mark", "far_apart"],
)
def test_other_rows_of_one_id_are_refused(tmp_path, text, what):
    with pytest.raises(BadInputError, match=what) as caught:
        read(tmp_path, text)
    assert caught.value.issue.code == "DUPLICATE_ID"


def test_two_columns_together_tell_rows_apart(tmp_path):
    table = read(tmp_path, "id;run;shot;x;y;z\nA;1;1;1;2;3\nA;1;2;3;2;3\nA;2;1;5;2;3\n")
    assert table.positions.tolist() == [[3, 2, 3]]


def test_without_repeats_nothing_changes(tmp_path):
    table = read(tmp_path, f"{HEAD};note\nA;1;1;2;3;x\nB;2;1;2;4;y\n")
    assert table.repeats is None
    assert not [issue for issue in table.issues if "told apart" in issue.message]
    assert table.columns["run"] == ["1", "2"]
    assert noise_of_table(table) is None


def test_other_columns(tmp_path):
    """Numbers: means of those that are there; texts: the first."""
    table = read(
        tmp_path,
        "id;run;x;y;z;j1;j2;jm1;e1;temperature_c;station;note\n"
        "A;1;1,0;2;3;10;20;1;5;20,5;140;ok\n"
        "A;2;1;2;3;12;20;;7;;140;late\n"
        "B;1;9;2;3;1;2;3;;21;150;\n"
        "B;2;9;2;3;1;2;5;;22;150;seen\n",
    )
    np.testing.assert_allclose(table.joints, [[11, 20], [1, 2]])
    np.testing.assert_allclose(table.measured_joints, [[1], [4]])
    np.testing.assert_allclose(table.external_axes[:, 0], [6, np.nan])
    np.testing.assert_allclose(table.numbers["temperature_c"], [20.5, 21.5])
    assert table.columns["temperature_c"] == ["20,5", "21.5"]
    assert "run" not in table.numbers
    assert table.columns["run"] == ["1", "1"]
    assert table.columns["station"] == ["140", "150"]
    assert table.columns["note"] == ["ok", "seen"]


def test_orientations_are_averaged_as_rotations(tmp_path):
    """179 and -179 degrees are 180, not 0; a row without an orientation takes no part."""
    table = read(
        tmp_path,
        "id;run;x;y;z;a;b;c\nA;1;1;2;3;179;0;0\nA;2;1;2;3;-179;0;0\nB;1;1;2;3;;;\nB;2;1;2;3;10;20;30\nC;1;1;2;3;;;\n",
    )
    assert list(table.oriented) == [True, True, False]
    wanted = Rotation.from_euler("ZYX", [[180, 0, 0], [10, 20, 30], [0, 0, 0]], degrees=True)
    assert np.degrees((table.rotations.inv() * wanted).magnitude()).max() < 1e-6


def test_units_are_settled_before(tmp_path):
    table = read(tmp_path, "id;run;x [in];y [in];z [in]\nA;1;1;0;0\nA;2;2;0;0\n")
    np.testing.assert_allclose(table.positions, [[38.1, 0, 0]])
    np.testing.assert_allclose(table.repeats.positions[:, 0], [25.4, 50.8])


def test_a_table_of_covariates(tmp_path):
    table = read(tmp_path, "id;run;force_n\nA;1;100\nA;2;300\n", pose_needed=False)
    assert table.numbers["force_n"].tolist() == [200.0]
    assert table.repeats.positions is None
    assert noise_of_table(table) is None


def test_the_noise_of_a_table_is_that_of_its_rows(tmp_path):
    rng = np.random.default_rng(1)
    places = rng.uniform(-1000, 1000, (40, 3))
    rows = [
        f"S{spot};{run};" + ";".join(f"{value:.4f}" for value in places[spot] + 0.25 * rng.normal(size=3))
        for run in range(3)
        for spot in range(40)
    ]
    table = read(tmp_path, "\n".join([HEAD, *rows]))
    found = noise_of_table(table)
    assert found is not None
    assert found.ids == tuple(table.ids)
    np.testing.assert_allclose(found.positions, table.positions, atol=1e-9)
    assert found.sigma == pytest.approx(0.25, rel=0.12)
    assert found.sigma_of_mean == pytest.approx(found.sigma / 3**0.5)
    assert noise_from_repeats(table.repeats.ids, table.repeats.positions).sigma == found.sigma
    order = rng.permutation(len(rows))
    again = noise_of_table(read(tmp_path, "\n".join([HEAD, *(rows[row] for row in order)]), "u.csv"))
    assert again.sigma == pytest.approx(found.sigma, rel=1e-12)
