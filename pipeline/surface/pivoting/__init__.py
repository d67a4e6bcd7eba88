"""Ball pivoting (Bernardini et al. 1999, SPEC 5): compiled, resumable, in batches that can be displayed."""

from pipeline.surface.pivoting.roller import (
    ALL_AT_ONCE,
    BallPivotStep,
    Rolled,
    Roller,
    compile_all,
    iterate_roll,
    roll,
)

__all__ = ["ALL_AT_ONCE", "BallPivotStep", "Rolled", "Roller", "compile_all", "iterate_roll", "roll"]
