"""HTML pages and pictures that commands write without a display. From ``app`` they import only ``drawing``,
``compute`` and ``web``.
"""
