"""Ball pivoting (Bernardini et al. 1999, SPEC 5): compiled, resumable, watchable, one batch at a time."""

from pipeline.surface.pivoting.roller import BallPivotBatch, Rolled, Roller, compile_all, iterate_roll, roll

__all__ = ["BallPivotBatch", "Rolled", "Roller", "compile_all", "iterate_roll", "roll"]
