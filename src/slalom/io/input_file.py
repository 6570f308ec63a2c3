"""Input files: regular files of bounded size, whose whole text is read at once."""

import stat
from pathlib import Path

from slalom.errors import InvalidFile, reason
from slalom.tolerances import MAX_FILE_SIZE


def file_size(path: Path, kind: str = "text file") -> int:
    """Return the size [B] of a regular file, without opening it: opening a pipe can block without end.

    Raises:
        InvalidFile: no such file; a folder, a pipe or a device; a file above MAX_FILE_SIZE. `kind` is in the message.
    """
    try:
        found = path.stat()
    except (OSError, ValueError) as error:
        raise InvalidFile([f"{path}: expected a readable {kind}, found {reason(error)}"]) from None
    if not stat.S_ISREG(found.st_mode):
        what = next((name for is_kind, name in _KINDS if is_kind(found.st_mode)), "something else")
        raise InvalidFile([f"{path}: expected a readable {kind}, found {what}"])
    if found.st_size > MAX_FILE_SIZE:
        size = f"{found.st_size / 1e6:.0f} MB"
        raise InvalidFile([f"{path}: expected a {kind} of at most {MAX_FILE_SIZE / 1e6:.0f} MB, found {size}"])
    return found.st_size


_KINDS = ((stat.S_ISDIR, "a folder"), (stat.S_ISFIFO, "a pipe"), (stat.S_ISCHR, "a device"), (stat.S_ISBLK, "a device"))


def beginning_of(path: Path, count: int) -> bytes:
    """Read the first `count` bytes of a file. Raises InvalidFile if that is not possible."""
    file_size(path, "file")
    return _read(path, count, "file")


def text_of(path: Path, kind: str = "text file") -> str:
    """Read the text of a file in UTF-8. Raises InvalidFile if that is not possible."""
    # At most its size: some files of an operating system have size 0 and no end.
    content = _read(path, file_size(path, kind), kind)
    try:
        return content.decode("utf-8-sig").replace("\r\n", "\n").replace("\r", "\n")
    except UnicodeDecodeError as error:
        raise InvalidFile([f"{path}: expected a readable {kind}, found {error}"]) from None


def _read(path: Path, count: int, kind: str) -> bytes:
    try:
        with path.open("rb") as file:
            return file.read(count)
    except OSError as error:
        raise InvalidFile([f"{path}: expected a readable {kind}, found {reason(error)}"]) from None
