"""What stands in each part of the page of a fit, as plain texts and numbers for the template."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from respot.figures.charts import share
from respot.figures.verdict import heldout_words, record_of_causes
from respot.figures.words import (
    REMEDY_PLACES,
    chance,
    count,
    decimals_of,
    effect_noun,
    figure,
    finding,
    in_plain_words,
    listing,
    place,
    scheme_text,
    sentence,
    separation,
    value_text,
)

#: Names of spots that a table cell or a list of left-out spots shows.
_MOST_NAMES = 24
#: Rows of a table of what was tried that stand open; the rest is folded away.
_MOST_OPEN = 20
_AXES = ("x", "y", "z")
#: A spread this many times the next one points one way.
_ONE_WAY = 2.0
_BY_HAND = " A spread along one direction of the part is often how people space spots by hand."

Record = Mapping[str, Any]


def compared(record: Record, source: str, reference: str) -> dict[str, Any]:
    """Say what was compared: the lists, what they mean, how many spots took part and which did not."""
    theory, same = record.get("kind") == "theory", record.get("frame") == "same"
    meaning = (
        "Theory: the reference says where the spots should be."
        if theory
        else "Measured: the reference says where the robot really went."
    )
    frames = (
        "The same for both lists, so the shift between them counts as an error."
        if same
        else "Each list has its own. The shift between them is no error; it is taken out first, and a part of an "
        "effect that looks like a shift goes with it."
    )
    use = (
        "Writing this back with respot convert makes programs for the cell as simulated: their points sit where the "
        "theory has them. The real, old cell must never load those files."
        if theory
        else "This says where the real robot goes. It changes no program by itself: remove the causes below first."
    )
    matching = record.get("matching") or {}
    by = "place (geometry)" if matching.get("by") == "geometry" else "name (ID)"
    outliers = [spot for spot in record.get("spots") or () if not spot.get("inlier", True)]
    threshold = record.get("inlier_threshold")
    limit = "" if threshold is None else f": more than {figure(threshold)} mm from where the model puts them"
    left_out = [
        (f"{count(len(outliers), 'spot does', 'spots do')} not follow the model{limit}", _names(outliers)),
        ("Only in the source", _names(record.get("missing") or ())),
        ("Only in the reference", _names(record.get("extra") or ())),
    ]
    return {
        "source": source,
        "reference": reference,
        "meaning": meaning,
        "frames": frames,
        "use": None if record.get("method") == "affine" else use,
        "counts": f"{record.get('n_source')} in the source, {record.get('n_reference')} in the reference",
        "matched": f"{record.get('n_matched')} by {by}",
        "inliers": f"{record.get('n_inliers')} of {record.get('n_matched')} follow the model (inliers)",
        "left_out": [(what, names) for what, names in left_out if names],
        "renamed": [f"{pair['id']} = {pair['reference_id']}" for pair in matching.get("not_equal_names") or ()],
        "method": _METHODS.get(str(record.get("method"))),
    }


_METHODS = {
    "paper": "The errors after the fit and the table of spots are those of the paper's method (subsets of spots). "
    "Causes were looked for with respot's own robust fit of the same pairs.",
    "affine": "This is the unconstrained fit with 12 free numbers, shown for comparison only: it may stretch and shear "
    "the part, which no robot does. Causes were looked for with respot's own robust fit of the same pairs.",
}


def _names(items: Iterable[Any]) -> str:
    names = [str(item["id"]) if isinstance(item, Mapping) else str(item) for item in items]
    return listing(names, most=_MOST_NAMES)


def rigid_shift(record: Record) -> dict[str, Any] | None:
    """Give the plain shift and turn of the model, of the middle of the spots and about the axes of the reference."""
    transform = record.get("transform")
    if not transform:
        return None
    half = transform.get("ci95") or {}
    rotation, centre = transform["rotation"], transform.get("centroid")
    rows = []
    if centre is not None and record.get("frame") == "same":
        arm = [c - t for c, t in zip(centre, transform["translation"], strict=True)]
        before = [math.fsum(rotation[i][j] * arm[i] for i in range(3)) for j in range(3)]
        rows += [
            (f"shift in {axis}", _with_half(c - b, half.get(f"t{axis}"), "mm"))
            for axis, c, b in zip(_AXES, centre, before, strict=True)
        ]
        rows += [
            (f"turn about {axis}", _with_half(turn, half.get(f"r{axis}"), "degrees"))
            for axis, turn in zip(_AXES, _rotation_vector(rotation), strict=True)
        ]
    else:
        shift, turn = transform["translation"], transform["abc"]
        rows += [(axis.upper(), f"{value:.3f} mm") for axis, value in zip(_AXES, shift, strict=True)]
        rows += [(angle, f"{value:.4f} degrees") for angle, value in zip("ABC", turn, strict=True)]
    support = record.get("rotation_support") or {}
    return {
        "rows": rows,
        "same": record.get("frame") == "same",
        "verdict": sentence(str(support.get("verdict") or "")),
        "only_part": bool(transform.get("tool_offset") or record_of_causes(record).get("effects")),
    }


def _with_half(value: float, half: float | None, unit: str) -> str:
    return value_text(value, None if half is None else (value - half, value + half), unit)


def _rotation_vector(rotation: Sequence[Sequence[float]]) -> list[float]:
    """Turn about each axis [degrees]; the lists claim one coordinate system, so the turn is far from 180 degrees."""
    skew = [rotation[2][1] - rotation[1][2], rotation[0][2] - rotation[2][0], rotation[1][0] - rotation[0][1]]
    sine, cosine = math.hypot(*skew) / 2, (rotation[0][0] + rotation[1][1] + rotation[2][2] - 1) / 2
    angle = math.atan2(sine, cosine)
    factor = 0.5 if sine < 1e-12 else angle / (2 * sine)
    return [math.degrees(factor * part) for part in skew]


def residual(record: Record) -> dict[str, Any]:
    """Say how large the residual is before anything is added, and which way residuals point."""
    spread = record.get("residual_sd_xyz") or ()
    largest = max(spread, default=0.0)
    decimals = decimals_of(largest)
    rows = [
        {"axis": axis, "value": figure(value, decimals), "share": share(value, largest)}
        for axis, value in zip(_AXES, spread, strict=False)
    ]
    before, worst = record["before"], max(record.get("spots") or (), key=lambda s: float(s["before"]), default=None)
    return {
        "rms": figure(before["rms"]),
        "mean": figure(before["mean"]),
        "max": figure(before["max"]),
        "worst": None if worst is None else str(worst["id"]),
        "rows": rows,
        "words": _direction_words(record) if rows else "",
    }


def _direction_words(record: Record) -> str:
    directions = sorted(record.get("residual_directions") or (), key=lambda entry: -float(entry["sd"]))
    if not directions:
        return ""
    first, spreads = directions[0], [float(entry["sd"]) for entry in directions]
    if len(spreads) > 1 and spreads[0] <= _ONE_WAY * spreads[1]:
        return "No single direction stands out."
    axis = [float(part) for part in first["axis"]]
    along = _AXES[max(range(3), key=lambda i: abs(axis[i]))]
    flip = -1.0 if axis[_AXES.index(along)] < 0 else 1.0
    vector = ", ".join(f"{figure(flip * part, 2)}" for part in axis)
    times = f"{spreads[0] / spreads[1]:.0f} times" if len(spreads) > 1 and spreads[1] > 0 else "far more than"
    return (
        f"What is left points mostly along {along} (direction {vector}), {times} as much as along the next direction."
        f"{_BY_HAND if record.get('kind') == 'theory' else ''}"
    )


def added(effect: Record) -> dict[str, Any]:
    """Describe one effect that was added to the model."""
    name, where = str(effect["name"]), effect.get("where") or {}
    parameters = [
        {
            "name": str(key).replace("_", " "),
            "value": value_text(entry.get("value"), entry.get("ci95"), str(entry.get("unit") or "")),
        }
        for key, entry in (effect.get("parameters") or {}).items()
    ]
    gain, rivals = effect.get("heldout_gain"), list(effect.get("rivals") or ())
    own = effect.get("heldout_rms")
    scores = [float(entry["heldout_rms"]) for entry in (effect, *rivals) if entry.get("heldout_rms") is not None]
    largest, decimals = max(scores, default=0.0), decimals_of(min(filter(None, scores), default=1.0))
    return {
        "name": name,
        "noun": effect_noun(name),
        "placed": effect_noun(name, where),
        "place": place(where) or "the whole list",
        "text": sentence(finding(effect)),
        "named": bool(effect.get("named")),
        "certainty": separation(effect),
        "parameters": parameters,
        "chance": None if effect.get("p_value") is None else chance(effect["p_value"]),
        "p_value": effect.get("p_value"),
        "gain": None if gain is None else figure(gain),
        "evidence": evidence(effect.get("evidence") or {}),
        "own": None if own is None else {"value": figure(own, decimals), "share": share(own, largest)},
        "rivals": [
            {
                "name": sentence(effect_noun(str(rival["name"]), rival.get("where"))).rstrip("."),
                "value": figure(rival.get("heldout_rms"), decimals),
                "share": share(rival.get("heldout_rms"), largest),
            }
            for rival in sorted(rivals, key=lambda rival: _last(rival.get("heldout_rms")))
        ],
    }


def evidence(values: Record) -> list[tuple[str, str]]:
    """Spell the free entries of evidence for a table of two columns."""
    return [(str(key).replace("_", " "), _plain(value)) for key, value in values.items()]


def _plain(value: Any) -> str:
    if value is None:
        return "not known"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.4g}"
    if isinstance(value, Mapping):
        return "; ".join(f"{str(key).replace('_', ' ')}: {_plain(entry)}" for key, entry in value.items()) or "none"
    if isinstance(value, list | tuple):
        inner = [
            f"({_plain(entry)})" if isinstance(entry, list | tuple | Mapping) else _plain(entry) for entry in value
        ]
        return ", ".join(inner) or "none"
    return str(value)


def _last(value: float | None) -> float:
    return math.inf if value is None else float(value)


def losers(record: Record) -> dict[str, Any]:
    """List what was tried, the best of it first, and the plain models for comparison."""
    tried = sorted(record_of_causes(record).get("effects_tried") or (), key=lambda e: _last(_tried_rms(e)))
    rows = [
        {
            "name": sentence(effect_noun(str(entry["name"]), entry.get("where"))).rstrip("."),
            "rms": figure(_tried_rms(entry)),
            "chance": "-" if entry.get("p_value") is None else chance(entry["p_value"]),
            "verdict": sentence(in_plain_words(str(entry.get("verdict") or _accepted(entry)))),
        }
        for entry in tried
    ]
    return {"open": rows[:_MOST_OPEN], "folded": rows[_MOST_OPEN:], "models": _plain_models(record)}


def _tried_rms(entry: Record) -> float | None:
    """Error on spots left out, under the name of today's record or of the tool offset's own trial."""
    value = entry.get("heldout_rms", entry.get("leave_one_out"))
    return None if value is None else float(value)


def _accepted(entry: Record) -> str:
    return {True: "accepted", False: "not accepted"}.get(entry.get("accepted"), "")  # type: ignore[arg-type]


def _plain_models(record: Record) -> list[dict[str, str]]:
    out = record.get("leave_one_out") or {}
    translation, affine = record.get("translation_only"), record.get("affine_12")
    rows = []
    repaired = any(spot.get("repaired") for spot in record.get("spots") or ())
    given, names = (", names as given", ", names repaired") if repaired else ("", "")
    if translation:
        rows.append((f"Shift alone, no turn{names}", translation.get("rms"), translation.get("leave_one_out")))
    rows.append((f"Shift and turn{given}", record["before"]["rms"], out.get("before")))
    if affine:
        rows.append((f"12 free numbers{given}", affine.get("rms"), affine.get("leave_one_out")))
    if record.get("method") != "affine":
        rows.append(("The final model", record["after"]["rms"], out.get("after")))
    decimals = decimals_of(min((rms for _, rms, _ in rows if rms), default=1.0))
    return [{"name": name, "rms": figure(rms, decimals), "loo": figure(loo, decimals)} for name, rms, loo in rows]


def errors(record: Record) -> dict[str, Any]:
    """Set the errors before and after side by side, with bars, and hold them against the noise."""
    heldout, out = record.get("heldout") or {}, record.get("leave_one_out") or {}
    after, n = record["after"], record.get("n_matched")
    rows: list[tuple[str, str, Mapping[str, Any] | None]] = []
    if record.get("frame") == "same":
        rows.append(("As found", "no transform, names as given", record.get("as_found")))
    rows.append(("Before", "shift and turn of all spots, names as given", record["before"]))
    rows.append(("After", f"final model, the {after.get('n')} spots that follow it", after))
    if record.get("after_all") and record["after_all"].get("n") != after.get("n"):
        rows.append(("After, all spots", "final model, outliers with it", record["after_all"]))
    if heldout.get("scheme") != "leave-one-out":
        rows += [
            (f"Left out one by one, {when}", "each spot predicted from all others", {"rms": out[when], "n": n})
            for when in ("before", "after")
            if out.get(when) is not None
        ]
    whose = heldout_words(heldout.get("scheme"))
    rows += [(f"Held out, {when}", whose, heldout[when]) for when in ("before", "after") if heldout.get(when)]
    drawn = [row[2]["rms"] for row in rows if row[2] and row[0] != "As found"]
    largest = max(drawn, default=0.0)
    as_found = (record.get("as_found") or {}).get("rms") or 0.0
    # a bar many times the others would make them vanish; it is cut and says so
    cut = record.get("frame") == "same" and as_found > 8 * largest
    if record.get("frame") == "same" and not cut:
        largest = max(largest, as_found)
    decimals = decimals_of(min((rms for rms in drawn if rms), default=1.0))
    return {
        "rows": [
            {
                "label": label,
                "note": note,
                "kind": "before" if "efore" in label else "after" if "fter" in label else "found",
                "share": share(values["rms"], largest),
                "cut": cut and label == "As found",
                **{key: figure(values.get(key), decimals) for key in ("rms", "mean", "max")},
                "n": str(values.get("n") or "-"),
            }
            for label, note, values in rows
            if values
        ],
        "scheme": scheme_text(heldout.get("scheme")),
        "heldout_n": heldout.get("n"),
        "repaired": _names(heldout.get("repaired_ids") or ()),
        "noise": _noise(record),
    }


_NOISE_SOURCES = {"repeats": "repeat measurements", "--noise": "the option --noise"}


def _noise(record: Record) -> dict[str, Any]:
    noise = record.get("noise") or {}
    floor, ratio, sigma = noise.get("floor", record.get("noise_floor")), noise.get("ratio"), noise.get("sigma")
    left = "" if sigma is None else f"What is left scatters by {figure(sigma)} mm along each coordinate. "
    if floor is None:
        return {
            "reached": None,
            "text": f"{left}How small it could get is not known: no repeat measurements and no --noise were given. So "
            "the fit cannot show that nothing else is at work.",
        }
    source = _NOISE_SOURCES.get(str(noise.get("source")), str(noise.get("source") or "the option --noise"))
    known = f"{left}The noise itself is {figure(floor)} mm (from {source})"
    times = "" if ratio is None else f", so what is left is {figure(ratio, 2)} times the noise"
    verdicts = {
        True: " The noise floor is reached: nothing larger than the noise is left to explain.",
        False: " The noise floor is not reached: something besides noise is left.",
        None: "",
    }
    return {"reached": noise.get("reached"), "text": f"{known}{times}.{verdicts[noise.get('reached')]}"}


def remedies(record: Record) -> dict[str, Any]:
    """List what to do, effect by effect, and which spots to look at."""
    effects = record_of_causes(record).get("effects") or ()
    steps = []
    for effect in effects:
        remedy = effect.get("remedy") or {}
        if not remedy:
            continue
        where = str(remedy.get("where") or "")
        steps.append(
            {
                "place": REMEDY_PLACES[where][0] if where in REMEDY_PLACES else sentence(where).rstrip("."),
                "cause": effect_noun(str(effect["name"]), effect.get("where")),
                "named": bool(effect.get("named")),
                "text": str(remedy.get("text") or ""),
            }
        )
    outliers = [spot for spot in record.get("spots") or () if not spot.get("inlier", True)]
    robot = any((effect.get("remedy") or {}).get("where") == "robot" for effect in effects)
    return {"steps": steps, "outliers": _names(outliers), "either_or": robot}


def unsaid(record: Record) -> dict[str, Any]:
    """List what the data cannot tell, and what to measure next."""
    causes = record_of_causes(record)
    hidden = [
        {
            "name": sentence(effect_noun(str(entry["name"]), entry.get("where"))).rstrip("."),
            "share": "-" if entry.get("share") is None else f"{100 * float(entry['share']):.0f} %",
            "by": _absorber(entry.get("absorbed_by")),
            "measure": sentence(str(entry.get("measure") or "")) or "-",
        }
        for entry in causes.get("hidden") or ()
    ]
    left = causes.get("unexplained") or {}
    words = {
        True: "Something is left that no known effect explains.",
        False: "Nothing is left that looks like more than noise.",
        None: "Whether something unexplained is left was not judged.",
    }
    return {
        "hidden": hidden,
        "questions": [
            {"text": sentence(str(entry["text"])), "missing": entry.get("missing")}
            for entry in causes.get("questions") or ()
        ],
        "unexplained": sentence(str(left.get("text") or words[left.get("present")])),
        "present": left.get("present"),
        "correlates": [
            {
                "column": str(entry["column"]),
                "strength": figure(entry.get("strength"), 2),
                "chance": chance(entry.get("p_value")),
            }
            for entry in left.get("correlates") or ()
        ],
        "next": [sentence(str(text)) for text in causes.get("measure_next") or ()],
        "open_causes": [
            f"{effect_noun(str(effect['name']), effect.get('where'))}, or {listing(names, last='or')}"
            for effect in causes.get("effects") or ()
            if (names := [effect_noun(str(name)) for name in effect.get("not_separated_from") or ()])
        ],
    }


def _absorber(by: Any) -> str:
    if not by:
        return "-"
    names = by if isinstance(by, list | tuple) else [by]
    return listing("shift and turn" if name in {"rigid", "registration"} else effect_noun(str(name)) for name in names)


def spot_rows(record: Record, tolerance: float) -> dict[str, Any]:
    """List all spots, the worst first, with what marks them."""
    spots = sorted(record.get("spots") or (), key=lambda spot: -float(spot["after"]))
    rows = []
    for spot in spots:
        after, inlier = float(spot["after"]), bool(spot.get("inlier", True))
        marks = [
            text
            for text, holds in (
                ("out of tolerance", after > tolerance),
                ("outlier", not inlier),
                ("name repaired", bool(spot.get("repaired"))),
            )
            if holds
        ]
        rows.append(
            {
                "id": str(spot["id"]),
                "reference": str(spot.get("reference_id") or spot["id"]),
                "marks": marks,
                "bad": after > tolerance,
                **{key: figure(spot.get(key), 2) for key in ("as_found", "before", "after")},
                **{key: f"{float(spot[key]):+.2f}" for key in ("dx", "dy", "dz")},
            }
        )
    return {
        "rows": rows,
        "renamed": any(row["reference"] != row["id"] for row in rows),
        "found": record.get("frame") == "same",
        "out": sum(bool(row["bad"]) for row in rows),
    }
