"""A folder for caches: compiled forms and fonts of the libraries, arrays of heights."""

import os
import stat
from pathlib import Path
from tempfile import gettempdir, mkdtemp


def use_writable_cache() -> str:
    """Let the libraries keep their caches in a temporary folder if the user's cannot be written.

    The folder belongs to the user alone and stays for later runs, because DOLFINx takes a while to
    compile its forms. The environment of this process names it, as XDG_CACHE_HOME. The sentence
    that is returned says so; it is empty if the user's folder can be written.
    """
    try:
        cache = user_cache()
        cache.mkdir(parents=True, exist_ok=True)
        if os.access(cache, os.W_OK | os.X_OK):
            return ""
    except (OSError, RuntimeError):  # RuntimeError: this user has no home folder
        cache = Path("~/.cache")
    user = os.getuid()
    folder = Path(gettempdir()) / f"fem-seal-cache-{user}"
    try:
        folder.mkdir(mode=0o700, exist_ok=True)
        status = folder.lstat()
        own = stat.S_ISDIR(status.st_mode) and status.st_uid == user
        if not own or stat.S_IMODE(status.st_mode) & 0o077:
            raise PermissionError  # another user could put programs into it
    except OSError:
        folder = Path(mkdtemp(prefix="fem-seal-cache-"))
    # The configuration stands beside the cache in an ordinary home; matplotlib and FFCx want both.
    os.environ["XDG_CACHE_HOME"] = str(folder)
    os.environ["XDG_CONFIG_HOME"] = str(folder)
    return f"{cache} cannot be written; {folder} keeps compiled forms in its place"


def user_cache() -> Path:
    """Folder of the user's caches."""
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
