"""Ball pivoting, our own (Bernardini et al. 1999, SPEC 5).

``reconstruct_surface`` still rolls Open3D's ball; this one takes its place once the whole chain has been
measured with it.
"""

from pipeline.surface.pivoting.roller import BallPivotBatch, Rolled, Roller, iterate_roll, roll

__all__ = ["BallPivotBatch", "Rolled", "Roller", "iterate_roll", "roll"]
