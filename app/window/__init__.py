"""Parts that every screen is built from: controls, tables, the stepper, and the page's script and style.
Imports of ``app`` only ``drawing``, ``compute`` and ``web``.
"""
