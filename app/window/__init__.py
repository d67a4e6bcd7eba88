"""Parts that every screen is built from: controls, tables, the stepper, and the page's script and style.
The folder imports only ``drawing``, ``compute`` and ``web`` of ``app``.
"""
