"""What every screen is made of. Imports of ``app`` only ``drawing``, ``compute`` and ``web``."""
