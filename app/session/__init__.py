"""One browser's session with its address and view, and the lecture that many browsers share. From
``app`` it imports only ``window`` and the packages that ``window`` imports.
"""
