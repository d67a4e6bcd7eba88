"""Drawings of clouds, meshes, cameras, plots and timelines. From ``app`` they import only ``compute`` and
``web``.
"""
