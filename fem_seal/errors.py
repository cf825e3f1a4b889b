"""The errors users meet. Each message names the field, the value, what is allowed and the mend."""


class FemSealError(Exception):
    """Any failure that fem_seal can explain in one sentence."""

    exit_status = 1


class InvalidInput(FemSealError):
    """The scene, a file or an argument asks for something that cannot be (exit status 2)."""

    exit_status = 2


class MissingPackage(InvalidInput):
    """A package or a system library that this scene needs is not installed (exit status 2)."""


class NotConverged(FemSealError):
    """An iteration stopped before it reached its tolerance (exit status 3)."""

    exit_status = 3
