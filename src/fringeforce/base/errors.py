"""The package's own errors: one base, and one kind for each thing a caller can put right."""


class FringeforceError(Exception):
    """Base of every error that fringeforce raises on purpose.

    Examples
    --------
    >>> try:
    ...     ff.load_sensor("sad")
    ... except ff.FringeforceError as error:
    ...     print(error)
    There is no design 'sad' to read ... did you mean 'saad'?
    """


class InputError(FringeforceError, ValueError):
    """A value that was passed in cannot be used; the text names it, the limit and the remedy."""


class DesignError(InputError):
    """A sensor's design is incomplete, inconsistent or not physical."""


class FileFormatError(FringeforceError, OSError):
    """A file is missing, truncated, or not what its name promises."""


class CameraLost(FringeforceError, ConnectionError):  # noqa: N818 - what happened, and may pass
    """A camera does not answer any more; it may come back."""


class LargeStrainWarning(UserWarning):
    """Loads strain a sensor further than its model covers; the text names both and the remedy."""
