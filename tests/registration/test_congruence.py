from __future__ import annotations

import numpy as np
import pytest

from respot.registration.congruence import congruence, shifted_rows, unit_factor
from respot.registration.errors import RegistrationError
from respot.registration.pairing import pair_spots


def names(n, prefix="S"):
    return [f"{prefix}{k:03d}" for k in range(n)]


def box(seed, n=14):
    return np.random.default_rng(seed).uniform(-1, 1, (n, 3)) * [800, 400, 600]


def code_of(*arguments, **options):
    with pytest.raises(RegistrationError) as caught:
        pair_spots(*arguments, **options)
    return caught.value.code, str(caught.value)


def test_three_points_that_a_user_could_not_reconcile():
    """One pair of distances agrees to 2 mm, the other two do not: the second point is the one in doubt."""
    robot = np.array([(1536, 120, -516), (1531, -864, -507), (2474, -658, -613)], dtype=float)
    nominal = np.array([(3553, -610, 767), (2734, -610, 1455), (3553, 610, 767)], dtype=float)
    found = congruence(robot, nominal)
    sides = ((0, 1), (0, 2), (1, 2))
    assert [found.source_distances[side] for side in sides] == pytest.approx([984, 1222, 971], abs=1)
    assert [found.reference_distances[side] for side in sides] == pytest.approx([1070, 1220, 1623], abs=1)
    assert not found.same_body
    assert found.suspects == (1,)
    code, message = code_of(["A", "B", "C"], robot, ["A", "B", "C"], nominal)
    assert code == "NOT_CONGRUENT"
    assert "B is 971 mm from C in the source, 1622 mm in the reference" in message


def test_two_exchanged_names_are_the_same_body_and_the_suspects(points):
    _, source, reference = points.repaired()
    assert congruence(source, reference).suspects == ()
    reference[[3, 9]] = reference[[9, 3]]
    found = congruence(source, reference)
    assert found.same_body
    assert set(found.suspects) == {3, 9}
    assert found.widest(3)[0] != 9


@pytest.mark.parametrize("noise", [1.0, 5.0, 10.0])
@pytest.mark.parametrize("n", [6, 14, 500])
def test_noise_is_no_other_body(points, noise, n):
    rng = np.random.default_rng(60)
    for _ in range(3 if n == 500 else 20):
        source = box(rng.integers(1e9), n)
        reference = points.move(source, *points.random_motion(rng)) + noise * rng.normal(size=(n, 3))
        reference[: n // 3] += rng.uniform(-300, 300, (n // 3, 3))
        found = congruence(source, reference)
        assert found.same_body
        if n == 14:
            assert set(found.suspects) <= set(range(4 if noise < 10 else 6))


def test_another_robots_list_is_refused_and_the_worst_spots_are_named():
    code, message = code_of(names(14), box(1), names(14), box(2))
    assert code == "NOT_CONGRUENT"
    assert "mm in the reference" in message
    assert "another robot's list" in message


def test_who_insists_on_names_between_two_frames_is_told_and_not_stopped():
    pairing = pair_spots(names(14), box(1), names(14), box(2), way="id")
    assert [note.code for note in pairing.notes] == ["NOT_CONGRUENT"]
    assert len(pairing.match.ids) == 14
    assert code_of(names(14), box(1), names(14), box(2), way="id", same_frame=True)[0] == "NOT_CONGRUENT"
    assert code_of(names(14), box(1), names(14), box(1) / 25.4, way="id")[0] == "UNIT_MISMATCH"


def test_names_that_are_mixed_up_are_refused_and_the_way_out_is_said():
    order = np.random.default_rng(3).permutation(14)
    code, message = code_of(names(14), box(1), names(14), box(1)[order] + 5.0)
    assert code == "NOT_CONGRUENT"
    assert "14 places agree" in message
    assert "--match geometry" in message


@pytest.mark.parametrize("shift", [1, -1, 3])
def test_rows_that_slipped_are_told_by_how_many(points, shift):
    _, source, reference = points.repaired()
    slipped = np.roll(reference, shift, axis=0)
    found = shifted_rows(source, slipped)
    assert found is not None
    assert found[0] == shift
    code, message = code_of(names(14), source, names(14), slipped)
    assert code == "ROWS_SHIFTED"
    assert f"slipped by {abs(shift)} row" in message
    assert shifted_rows(source, reference) is None


def test_rows_that_slipped_and_lost_one_at_the_end(points):
    _, source, reference = points.repaired()
    code, _ = code_of(names(14), source, names(13), reference[1:])
    assert code == "ROWS_SHIFTED"


@pytest.mark.parametrize(
    ("factor", "unit"),
    [(1 / 25.4, "inches"), (25.4, "inches"), (0.001, "metres"), (1000.0, "metres"), (0.1, "centimetres")],
)
@pytest.mark.parametrize("way", ["auto", "id", "geometry"])
def test_a_list_in_another_unit(points, factor, unit, way):
    _, source, reference = points.rear_door()
    assert unit_factor(source, reference * factor) == (pytest.approx(factor), unit)
    code, message = code_of(names(14), source, names(14), reference * factor, way=way)
    assert code == "UNIT_MISMATCH"
    assert unit in message


def test_a_part_ten_percent_larger_is_no_unit():
    assert unit_factor(box(1), 1.1 * box(1)) is None
    assert unit_factor(box(1), box(2)) is None


def test_auto_takes_places_where_names_have_nothing_in_common(points):
    _, source, reference = points.rear_door()
    order = np.random.default_rng(61).permutation(14)
    pairing = pair_spots(names(14), source, names(14, "X"), reference[order], same_frame=True)
    assert [note.code for note in pairing.notes] == ["MATCHED_BY_GEOMETRY"]
    assert set(pairing.match.rules) == {"geometry"}
    assert pairing.match.reference_ids[0] == f"X{list(order).index(0):03d}"
    assert code_of(names(14), source, names(14, "X"), reference, way="id")[0] == "NO_COMMON_IDS"
    code, message = code_of(names(14), source, names(14, "X"), box(4), same_frame=True)
    assert code == "NO_COMMON_IDS"
    assert "nor do places" in message


def test_three_common_names_that_places_contradict_are_not_overruled(points):
    _, source, reference = points.repaired()
    others = names(3) + names(14, "X")[3:]
    others[0], others[1] = others[1], others[0]
    code, message = code_of(names(14), source, others, reference, same_frame=True)
    assert code == "AMBIGUOUS_MATCH"
    assert "S000 lies at the place of S001" in message
    pairing = pair_spots(names(14), source, others, reference, way="geometry", same_frame=True)
    assert [note.code for note in pairing.notes] == ["MATCHED_BY_GEOMETRY", "NAMES_DISAGREE"]


def test_missing_and_extra_by_place():
    source = box(5, 16)
    keep = [k for k in range(16) if k != 4]
    reference = np.vstack([source[keep], [[2000, 2000, 0]]]) + 3.0
    match = pair_spots(names(16), source, names(16, "X"), reference).match
    assert match.missing == ("S004",)
    assert match.extra == ("X015",)
    assert (match.n_source, match.n_reference, len(match.ids)) == (16, 16, 15)


def test_a_name_twice_is_refused_however_spots_are_matched():
    for way in ("auto", "id", "geometry"):
        twice = [*names(13), "S000"]
        assert code_of(names(14), box(6), twice, box(6), way=way)[0] == "DUPLICATE_ID"
