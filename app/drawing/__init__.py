"""Drawings of clouds, meshes, cameras, plots and timelines. Imports of ``app`` only ``compute`` and
``web``.
"""
