"""Files that are written completely or not at all, and locks of the folders of a run.

Every other package writes its files through this one: a file is written under a staging name in
its folder, flushed to the disk and renamed. The next process that has the folder for itself removes
what a killed one has left.
"""

from fem_seal.files.atomic import (
    atomic_write,
    create_text,
    digest,
    digest_of_sources,
    names_in,
    staging_folder,
    temporary_folder,
    to_disk,
    write_npz,
    write_text,
    writing,
)
from fem_seal.files.caches import use_writable_cache, user_cache
from fem_seal.files.lock import PATCHES, POINTS, locked_folder
