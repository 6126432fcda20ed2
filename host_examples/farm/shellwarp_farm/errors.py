"""What can go wrong that is not a defect of the program."""


class FarmError(Exception):
    """A message for the person at the keyboard."""


class SceneError(FarmError):
    """The scene list, or a file that it names, is wrong; trying again would not help."""


class DamagedError(FarmError):
    """A file is not what was written."""
