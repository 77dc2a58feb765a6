"""A line of robots: one file names them, one folder holds what came of them, and a ledger remembers what is done."""
