"""Staging, read back and prove, move into place, and take back.

Everything is made in a hidden folder beside its target, waited for until it is on the disk, read again from there,
compared with what was intended, and put into place in one step. An error, an interrupt or a kill leaves the old state.
"""

from respot.output.folders import check_output
from respot.output.in_place import check_in_place, write_in_place
from respot.output.new_folder import rehearse, write_backup
from respot.output.undo import Undone, undo

__all__ = ["Undone", "check_in_place", "check_output", "rehearse", "undo", "write_backup", "write_in_place"]
