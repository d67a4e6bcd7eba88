"""What all stages compute with: rigid motions, k-d tree, ordering, patches, rays, threads, Open3D's loading.
Imports of ``pipeline`` only ``types``.
"""
