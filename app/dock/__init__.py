"""The clock, the lanes and the plots at the lower edge of the window. From ``app`` it imports only
``window`` and the packages that ``window`` imports.
"""
