"""The parts that every screen is built from: controls, tables, the stepper, the page's script and style.
Imports of ``app`` only ``drawing``, ``compute`` and ``web``.
"""
