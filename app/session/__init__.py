"""One browser's session, its address and its view, and the lecture that many share. Imports of ``app`` only
``window`` and what is below it.
"""
