"""Exceptions by kind. Each has the message, what to do (`help`), and the place in a file."""

from __future__ import annotations

from typing import Optional


class IvcamError(Exception):
    """A wrong file or a wrong choice.

    Attributes:
        message: what is wrong.
        help: what to do about it, or `None`.
        file: the file that it is in, or `None`.
        line, column: the place in the file, from 1, or `None`.
    """

    def __init__(
        self,
        message: str,
        help: Optional[str] = None,
        file: Optional[str] = None,
        line: Optional[int] = None,
        column: Optional[int] = None,
    ) -> None:
        self.message = message
        self.help = help
        self.file = file
        self.line = line
        self.column = column
        super().__init__(message)

    def __str__(self) -> str:
        place = ""
        if self.file is not None:
            place = f"{self.file}: "
            if self.line is not None:
                place = f"{self.file}:{self.line}:{self.column}: "
        help = f" ({self.help})" if self.help else ""
        return f"{place}{self.message}{help}"


class NotFoundError(IvcamError, FileNotFoundError, LookupError):
    """There is no such file, lens or name."""


class FileError(IvcamError, OSError):
    """A file cannot be read or written."""


class SceneSyntaxError(IvcamError, ValueError):
    """A file is not in the format that it should be in."""


class DamagedError(IvcamError, ValueError):
    """A file is cut off or damaged."""


class OutsideFolderError(IvcamError, PermissionError):
    """A scene names a file outside the folders that it may read."""


class LimitError(IvcamError):
    """A file or a picture needs more memory, work or time than is allowed."""


class UnsupportedError(IvcamError):
    """Something that ivcam does not do, such as an unknown format."""


class ArgumentError(IvcamError, ValueError):
    """A wrong value of an option."""


class FocusError(IvcamError, ValueError):
    """A lens that cannot focus at a distance."""


class IvcamWarning(UserWarning):
    """Something that was left out or looks wrong, with its place and what to do."""
