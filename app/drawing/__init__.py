"""Clouds, meshes, cameras, plots and timelines as they are drawn. Imports of ``app`` only ``compute`` and
``web``.
"""
