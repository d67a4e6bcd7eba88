"""Lessons: their files, and the row above the picture that shows their stops. From ``app`` it imports only
``window`` and packages that ``window`` imports.
"""
