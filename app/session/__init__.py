"""One browser's session with its address and view, and the lecture that many browsers share. Imports of
``app`` only ``window`` and the packages that ``window`` imports.
"""
