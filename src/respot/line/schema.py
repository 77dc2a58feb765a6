"""Tables of the ledger."""

from __future__ import annotations

#: "rspt": tells a ledger from any other SQLite file.
APPLICATION = 0x72737074
#: Of the tables below; it goes up with every change of them.
VERSION = 1

SCHEMA: tuple[str, ...] = (
    "CREATE TABLE meta (key TEXT PRIMARY KEY, value TEXT NOT NULL)",
    "CREATE TABLE runs (id INTEGER PRIMARY KEY, process INTEGER NOT NULL, host TEXT NOT NULL, started REAL NOT NULL, "
    "ended REAL, version TEXT NOT NULL)",
    "CREATE TABLE jobs (robot TEXT PRIMARY KEY, position INTEGER, state TEXT NOT NULL DEFAULT 'waiting', "
    "input_hash TEXT NOT NULL DEFAULT '', option_hash TEXT NOT NULL DEFAULT '', version TEXT NOT NULL DEFAULT '', "
    "attempts INTEGER NOT NULL DEFAULT 0, started REAL, ended REAL, seconds REAL, cpu_seconds REAL, "
    "code TEXT NOT NULL DEFAULT '', error TEXT NOT NULL DEFAULT '', details TEXT NOT NULL DEFAULT '', "
    "figures TEXT NOT NULL DEFAULT '{}', traits TEXT NOT NULL DEFAULT '{}')",
    "CREATE TABLE fits (robot TEXT PRIMARY KEY, kind TEXT, spots INTEGER, inliers INTEGER, before_rms REAL, "
    "after_rms REAL, heldout_rms REAL) WITHOUT ROWID",
    "CREATE TABLE effects (robot TEXT NOT NULL, number INTEGER NOT NULL, name TEXT NOT NULL, named INTEGER NOT NULL, "
    "record TEXT NOT NULL, PRIMARY KEY (robot, number)) WITHOUT ROWID",
    "CREATE TABLE edits (robot TEXT NOT NULL, path TEXT NOT NULL, line INTEGER, target TEXT, depth TEXT, "
    "shift_mm REAL, turn_deg REAL)",
    "CREATE INDEX edits_of_robot ON edits (robot)",
    "CREATE TABLE outputs (robot TEXT NOT NULL, path TEXT NOT NULL, sha256 TEXT NOT NULL, bytes INTEGER NOT NULL, "
    "PRIMARY KEY (robot, path)) WITHOUT ROWID",
)
