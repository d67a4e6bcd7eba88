"""Depth: sensed and inferred, compared, aligned and judged."""
