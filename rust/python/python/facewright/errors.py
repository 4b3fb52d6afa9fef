"""Errors, by what a caller can do about them. Nothing was written or changed when one is raised."""


class FacewrightError(Exception):
    """A sentence that says what is wrong and what to do.

    `kind` is a word for programs: the sentence may be reworded, but the word stays the same.
    """

    kind: str = "other"


class InputError(FacewrightError):
    """Files cannot be read, are missing or do not belong together: use other files."""


class OutputError(FacewrightError):
    """A file or folder cannot be written: choose another location."""


class FilmError(FacewrightError):
    """The frames show too little: film again, or use other frames."""


class CameraError(FacewrightError):
    """The camera, the rig or the pictures of the board do not fit: calibrate again."""


class TracksError(FacewrightError):
    """Faces, tracks or motion that were given do not fit the frames."""


class OptionError(FacewrightError, ValueError):
    """An option has an impossible value."""


class SetupError(FacewrightError):
    """Something is not installed: the head and the nets, or a video decoder."""


class UsageError(FacewrightError):
    """A command line that cannot be parsed, or that asks for help: `exit_code` is 2, or 0 for help."""

    kind = "usage"
    exit_code: int = 2


class Cancelled(FacewrightError):
    """The job was cancelled."""

    kind = "cancelled"
