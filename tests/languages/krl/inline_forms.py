"""Reads the fixtures of ``tests/data/krl/forms``, made up after krl.md section 6, and says what stands in each."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from respot.languages.forms import Forms
from respot.languages.krl.forms import FORMS, Data, read_forms
from respot.languages.krl.symbols import Symbols, module_key, read_symbols
from respot.languages.krl.syntax import ENCODINGS, read_statements
from respot.program.forms import Form
from respot.source import SourceText, splice

FOLDER = Path(__file__).parents[2] / "data" / "krl" / "forms"
MODULES = ("basis", "krc2", "params", "spline", "spottech", "bmw", "nut_weld", "vkrc", "servogun")


def load(name: str) -> dict[str, bytes]:
    """A module's files, with the global data beside it."""
    return {path.name: path.read_bytes() for path in sorted(FOLDER.glob("*")) if path.stem in (name, f"{name}_global")}


def sources_of(files: Mapping[str, bytes]) -> dict[str, SourceText]:
    return {path: SourceText(path, data, ENCODINGS) for path, data in files.items()}


def read(files: Mapping[str, bytes], profiles: Forms = FORMS) -> list[Form]:
    """Forms of the first ``.src`` among the files."""
    sources = sources_of(files)
    statements = {path: read_statements(source.text, source.line_starts) for path, source in sources.items()}
    scopes = [
        read_symbols(path, found, module_key(path), path.lower().startswith("$config"))
        for path, found in statements.items()
        if path.endswith(".dat")
    ]
    path = next(path for path in files if path.endswith(".src"))
    return read_forms(sources[path], statements[path], Data(Symbols(scopes), sources), profiles)


def src(text: str) -> dict[str, bytes]:
    """A module of one file, without the lines around."""
    return {"a.src": f"DEF a ( )\n{text.strip()}\nEND\n".encode("cp1252")}


def change(files: Mapping[str, bytes], form: Form, field: str, value: str) -> dict[str, bytes]:
    sources = sources_of(files)
    edits = form.edits(field, value, sources)
    return {path: sources[path].encode(splice(sources[path].text, edits.get(path, ()))) for path in files}


def swap(files: Mapping[str, bytes], path: str, old: str, new: str) -> dict[str, bytes]:
    """Replace a text that stands just once."""
    text = files[path].decode("cp1252")
    assert text.count(old) == 1, (text.count(old), old)
    return {**files, path: text.replace(old, new).encode("cp1252")}


def form_at(files: Mapping[str, bytes], line: int) -> Form:
    return next(form for form in read(files) if form.line == line)


#: module -> one entry for each form: profile, line, and for each field its value and in which regions its copies stand:
#: T title, E tail, P parameters, B body, D data
EXPECTED = {
    "basis": [
        ("basis", 8, {
            "motion": ("PTP", "BEET"), "point": ("P1", "BBDDET"), "blend": ("on", "BET"), "velocity": ("80", "BET"),
            "data": ("PDAT1", "BDET"), "tool": ("3", "DT"), "tool_name": ("Zange groß", "T"), "base": ("4", "DT"),
            "base_name": ("Tür links", "T"), "external": ("off", "DT"),
        }),
        ("basis", 15, {
            "motion": ("LIN", "BEET"), "point": ("P2", "BBDDET"), "blend": ("off", "BET"), "velocity": ("0.5", "BET"),
            "data": ("CPDAT2", "BDET"), "tool": ("3", "DT"), "tool_name": ("Zange groß", "T"), "base": ("4", "DT"),
            "base_name": ("Tür links", "T"), "external": ("on", "DT"),
        }),
        ("basis", 22, {
            "motion": ("CIRC", "BEET"), "aux": ("P3", "BDET"), "point": ("P4", "BBDDET"), "blend": ("on", "BET"),
            "velocity": ("0.25", "BET"), "data": ("CPDAT3", "BDET"), "tool": ("3", "DT"), "base": ("4", "DT"),
            "external": ("off", "DT"),
        }),
        ("basis", 28, {
            "motion": ("PTP", "BEET"), "point": ("HOME", "BBBET"), "blend": ("off", "BET"), "velocity": ("100", "BET"),
            "data": ("DEFAULT", "BET"),
        }),
    ],
    "krc2": [
        ("basis", 3, {
            "motion": ("PTP", "BEET"), "point": ("P7", "BBDDET"), "blend": ("off", "BET"), "velocity": ("100", "BET"),
            "data": ("PDAT7", "BDET"), "tool": ("1", "DT"), "tool_name": ("TOOL 1", "T"), "base": ("0", "DT"),
            "external": ("off", "DT"),
        }),
    ],
    "params": [
        ("params", 2, {
            "motion": ("LIN", "BPT"), "point": ("P21", "BBDDPT"), "blend": ("on", "BPT"), "velocity": ("2", "BPT"),
            "data": ("CPDAT5", "BDPT"), "tool": ("2", "DT"), "tool_name": ("Gun B", "T"), "base": ("6", "DT"),
            "base_name": ("Jig", "T"), "external": ("off", "DT"),
        }),
    ],
    "spline": [
        ("spline", 2, {
            "block": ("S1", "T"), "velocity": ("1", "BT"), "data": ("CPDAT9", "BDT"), "tool": ("1", "T"),
            "base": ("2", "T"),
        }),
        ("spline", 4, {
            "motion": ("SLIN", "BPT"), "point": ("P5", "BBBBBDDPT"), "blend": ("on", "BPT"), "velocity": ("0.1", "BPT"),
            "data": ("CPDAT6", "BBBBBDPT"), "tool": ("1", "DT"), "tool_name": ("Gun", "T"), "base": ("2", "DT"),
            "base_name": ("Jig", "T"), "external": ("off", "DT"),
        }),
        ("spline", 12, {
            "motion": ("SPTP", "BPT"), "point": ("P6", "BBBBBDDPT"), "blend": ("off", "BPT"),
            "velocity": ("100", "BPT"), "data": ("PDAT6", "BBBDPT"), "tool": ("1", "DT"), "tool_name": ("Gun", "T"),
            "base": ("2", "DT"), "base_name": ("Jig", "T"), "external": ("off", "DT"),
        }),
    ],
    "spottech": [
        ("spottech", 2, {
            "motion": ("LIN", "BEET"), "point": ("P05WP4711", "BBDDET"), "velocity": ("0.5", "BET"),
            "data": ("CPDAT8", "BDET"), "tool": ("1", "DT"), "tool_name": ("Gun", "T"), "base": ("2", "DT"),
            "base_name": ("Door left", "T"), "external": ("off", "D"), "blend": ("off", "B"),
            "spot_data": ("SDAT8", "BDET"), "gun": ("1", "DT"), "pair": ("FIRST", "DT"), "retract": ("OPN", "DT"),
            "close_time": ("0", "D"), "program": ("21", "DT"), "pressure": ("2.6", "D"), "program_2": ("0", "D"),
            "pressure_2": ("0", "D"),
        }),
    ],
    "bmw": [
        ("bmw", 2, {
            "motion": ("PTP", "BT"), "point": ("via28", "BBDDPT"), "gun": ("1", "T"), "gun_open": ("180", "T"),
            "blend": ("on", "BPT"), "velocity": ("100", "BPT"), "data": ("PVIA28", "BDPT"), "tool": ("1", "DT"),
            "tool_name": ("xGun1", "T"), "base": ("1", "DT"), "base_name": ("030FX001", "T"), "external": ("off", "D"),
        }),
        ("bmw", 12, {
            "motion": ("PTP", "BT"), "type_id": ("22", "BBBBDDDPT"), "spot": ("40711", "BBBBDDDPT"),
            "gun": ("1", "BPT"), "gun_open": ("180", "PT"), "part_end": ("False", "T"), "equal_offset": ("False", "T"),
            "fast_close": ("False", "T"), "leave_ctrl": ("Ctrl", "T"), "velocity": ("100", "BPT"), "tool": ("1", "DT"),
            "tool_name": ("xGun1", "T"), "base": ("1", "DT"), "base_name": ("030FX001", "T"), "external": ("off", "D"),
            "blend": ("off", "BP"), "point": ("swp40711_22", "BBDD"), "data": ("swp40711_22", "BD"),
        }),
        ("bmw", 22, {
            "motion": ("PTP", "BPT"), "type_id": ("1", "BBBBBDDDPT"), "spot": ("50321", "BBBBBDDDPT"),
            "gun": ("2", "BBPT"), "gun_open": ("128", "BPT"), "feed": ("on", "PT"), "feed_forward": ("off", "PT"),
            "velocity": ("80", "BPT"), "tool": ("2", "DT"), "tool_name": ("Rivet_Gun", "T"), "base": ("1", "DT"),
            "base_name": ("030FX001", "T"), "external": ("off", "D"), "blend": ("off", "BP"),
            "point": ("rvt50321_1", "BBDD"), "data": ("rvt50321_1", "BD"),
        }),
        ("bmw", 34, {
            "command": ("Release", "PT"), "motion": ("PTP", "BPT"), "point": ("P30", "BBDDPT"), "number": ("12", "PT"),
            "blend": ("on", "BPT"), "velocity": ("100", "BPT"), "data": ("PP30", "BDPT"), "tool": ("2", "DT"),
            "tool_name": ("Rivet_Gun", "T"), "base": ("1", "DT"), "base_name": ("030FX001", "T"),
            "external": ("off", "D"),
        }),
    ],
    "nut_weld": [
        ("nut_weld", 2, {
            "motion": ("LIN", "BT"), "point": ("PNW1", "BBDDT"), "velocity": ("1", "BT"), "gun": ("1", "DT"),
            "program": ("7", "DT"), "offset": ("0", "D"), "data": ("PNW1CPDAT", "BD"), "nut_data": ("1", "BD"),
            "tool": ("1", "DT"), "tool_name": ("Part", "T"), "base": ("3", "DT"), "base_name": ("NUT WELDER", "T"),
            "external": ("on", "D"), "blend": ("off", "B"),
        }),
    ],
    "vkrc": [
        ("vkrc", 6, {
            "motion": ("LIN", "T"), "velocity": ("80", "ET"), "end_velocity": ("10", "ET"),
            "acceleration": ("50", "ET"), "tool": ("2", "ET"), "base": ("5", "ET"), "trigger": ("5", "ET"),
            "point": ("3", "BBBE"),
        }),
    ],
    "servogun": [
        ("servogun", 2, {
            "motion": ("PTP", "BT"), "point": ("P8", "BBDDT"), "blend": ("off", "BT"), "velocity": ("100", "BT"),
            "data": ("PDAT8", "BDT"), "tool": ("1", "DT"), "tool_name": ("Gun", "T"), "base": ("2", "DT"),
            "base_name": ("Jig", "T"), "external": ("off", "DT"),
        }),
    ],
}  # fmt: skip
LETTERS = {"title": "T", "tail": "E", "params": "P", "body": "B", "data": "D"}
