"""Lessons: their files, and the row above the picture that leads through them. Imports of ``app`` only
``window`` and the packages that ``window`` imports.
"""
