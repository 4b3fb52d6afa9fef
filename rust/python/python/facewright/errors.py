"""Errors, by what a caller can do about them. Nothing was written or changed when one is raised."""


class FacewrightError(Exception):
    """A sentence that says what is wrong and what to do.

    `kind` is a word for programs: the sentence may be reworded, the word stays.
    """

    kind: str = "other"


class InputError(FacewrightError):
    """Files cannot be read, are missing or do not belong together: give others."""


class OutputError(FacewrightError):
    """A file or folder cannot be written: give another place."""


class FilmError(FacewrightError):
    """The frames show too little: film again, or take other frames."""


class CameraError(FacewrightError):
    """The camera, the rig or the pictures of the board do not fit: calibrate anew."""


class TracksError(FacewrightError):
    """Faces, tracks or motion that were given do not fit the frames."""


class OptionError(FacewrightError, ValueError):
    """An option has a value that it cannot have."""


class SetupError(FacewrightError):
    """Something is not installed: the head and the nets, or a decoder of videos."""


class UsageError(FacewrightError):
    """A command line that cannot be read, or asks for help: `exit_code` is 0 where it does, else 2."""

    kind = "usage"
    exit_code: int = 2


class Cancelled(FacewrightError):
    """The job was cancelled."""

    kind = "cancelled"
