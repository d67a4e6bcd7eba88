"""What a long computation says about itself while it runs."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Progress:
    """One report of a running computation; generators yield it between units of work.

    Whoever consumes the generator decides what to do with it: draw a bar, log a line, or stop
    iterating, which cancels the computation.
    """

    stage: str
    """Name of the stage, in words a person reads (``"depth inference"``)."""
    fraction: float
    """Share of the whole computation that is done, 0 to 1."""
