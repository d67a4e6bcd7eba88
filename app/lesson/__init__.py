"""Lessons: their files, and the row above the stage that leads through them. Imports of ``app`` only
``window`` and what is below it.
"""
