"""Files that appear whole or not at all, and folders that one run at a time may fill.

Everything the package writes passes through here: a file is written under a staging name in the
folder it belongs to, flushed to the disk and renamed. The name of a staging file says which
process on which host made it, so that the next run can clear away what a killed one has left.
"""

from fem_seal.files.atomic import (
    atomic_write,
    create_text,
    staging_folder,
    temporary_folder,
    to_disk,
    write_npz,
    write_text,
    writing,
)
from fem_seal.files.digest import digest
from fem_seal.files.lock import locked_folder
from fem_seal.files.owner import clear_abandoned

__all__ = [
    "atomic_write",
    "clear_abandoned",
    "create_text",
    "digest",
    "locked_folder",
    "staging_folder",
    "temporary_folder",
    "to_disk",
    "write_npz",
    "write_text",
    "writing",
]
