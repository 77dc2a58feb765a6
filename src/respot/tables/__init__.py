"""Spot tables from CSV and XLSX, Process Simulate's lists among them, and back."""

from respot.tables.reading import read_table
from respot.tables.table import Table
from respot.tables.writing import write_table

__all__ = ["Table", "read_table", "write_table"]
