"""The steps of the app, one folder each, with panel, jobs, views, drawing, labels and lesson. A screen
imports no other screen, and of ``app`` only the layers below: ``lesson``, ``dock``, ``looking``,
``measuring``, ``session``, ``window``, ``reports``, ``notebook``, ``drawing``, ``compute`` and ``web``.
"""
