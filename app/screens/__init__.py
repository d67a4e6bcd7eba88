"""The steps of the app, one folder each, with panel, jobs, views, drawing, labels and lesson. A screen
imports no other screen, and of ``app`` only ``lesson``, ``dock``, ``session`` and what these import.
"""
