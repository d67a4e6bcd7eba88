"""HTML pages and pictures that commands write without a display. Imports of ``app`` only ``drawing``,
``compute`` and ``web``.
"""
