"""Writing of files: a new file takes the place of the former one when it is whole, or not at all."""

import errno
import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

from slalom.base.errors import InvalidFile, reason


@contextmanager
def writing(path: Path | str, also: type[Exception] = OSError) -> Iterator[None]:
    """Convert an OSError, or `also` the error of a package that writes, to InvalidFile that names `path`."""
    try:
        yield
    except (OSError, also) as error:
        raise InvalidFile([f"{path}: expected a file that can be written, found {reason(error)}"]) from None


def refuse_unwritable(path: Path) -> None:
    """Raise OSError for a folder, and for a file or a folder of a file without the permission to write."""
    if path.is_dir():
        raise IsADirectoryError(errno.EISDIR, "")
    if not all(os.access(each, os.W_OK) for each in (path.parent, path) if each.exists()):
        raise PermissionError(errno.EACCES, "")


@contextmanager
def replacing(path: Path | str, also: type[Exception] = OSError) -> Iterator[Path]:
    """Yield the path of a new file or folder, which takes the place of `path` when the block ends without an error.

    Otherwise what was at `path` is as before. The new file has the name and the permissions of the former one. It is in
    a folder .slalom-*.part beside it, which remains only if the process is killed. A link stays, and its file is
    replaced. A pipe or a device has no former content, and is itself written.

    Raises:
        InvalidFile: a folder, a file that cannot be written; see `writing`.
    """
    with writing(path, also):
        target = Path(os.path.realpath(path))
        if target.exists() and not target.is_file() and not target.is_dir():
            yield target
            return
        refuse_unwritable(target)
        with TemporaryDirectory(prefix=".slalom-", suffix=".part", dir=target.parent) as folder:
            part = Path(folder, target.name)
            yield part
            if target.exists():
                shutil.copymode(target, part)
            os.replace(part, target)


def write_file(path: Path | str, content: bytes | str, errors: str = "strict") -> None:
    """Write bytes, or a text in UTF-8, see `replacing`; `errors` is that of `str.encode`."""
    with replacing(path) as part:
        part.write_bytes(content if isinstance(content, bytes) else content.encode(errors=errors))
