"""Errors whose messages users see: one sentence that names the thing, its value and what to try."""

MOST_LETTERS = 1000
"""Longest sentence that a message holds in full, in characters; a message may quote a file."""


class PacketMeshError(Exception):
    """Base of the errors of which the app and the command line show only the message, without a stack trace.

    A sentence over ``MOST_LETTERS`` loses its middle, and every character that cannot be printed becomes a
    blank, because the sentence may quote a file.
    """

    def __init__(self, sentence: str) -> None:
        half = MOST_LETTERS // 2
        if len(sentence) > MOST_LETTERS:
            sentence = f"{sentence[:half]} … {sentence[-half:]}"
        super().__init__("".join(letter if letter.isprintable() else " " for letter in sentence))


class InputError(PacketMeshError):
    """A file, value or combination of values that cannot be used."""


class ReconstructionError(PacketMeshError):
    """A stage could not produce a result from readable input."""
