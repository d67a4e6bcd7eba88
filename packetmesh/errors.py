"""Errors with a message for people: one sentence that names the thing, its value and what to try."""

MOST_LETTERS = 1000
"""Of a message, which may quote a file."""


class PacketMeshError(Exception):
    """Base of the errors that the app and the command line show as their message, without a stack trace.

    The message is one line that can be printed, whatever it quotes of a file.
    """

    def __init__(self, sentence: str) -> None:
        half = MOST_LETTERS // 2
        if len(sentence) > MOST_LETTERS:
            sentence = f"{sentence[:half]} … {sentence[-half:]}"
        super().__init__("".join(letter if letter.isprintable() else " " for letter in sentence))


class InputError(PacketMeshError):
    """A file, value or combination of values that cannot be used."""


class ReconstructionError(PacketMeshError):
    """The input was readable, but a stage could not produce a result from it."""
