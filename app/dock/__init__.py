"""The clock, the lanes and the plots at the lower edge of the window. Imports of ``app`` only ``window`` and
the packages that ``window`` imports.
"""
