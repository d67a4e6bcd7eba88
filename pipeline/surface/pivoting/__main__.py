"""``python -m pipeline.surface.pivoting``: compile the ball, so that its first use is not a wait."""

from pipeline.surface.pivoting import compile_all

compile_all()
