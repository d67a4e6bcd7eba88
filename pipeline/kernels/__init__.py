"""Computations shared by all stages: rigid motions, k-d tree, sorting, patches, rays, threads, Open3D import.
This folder imports only ``types`` of ``pipeline``.
"""
