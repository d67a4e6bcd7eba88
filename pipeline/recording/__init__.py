"""Recordings: frames in time, their trajectory, and the map made of them.

``opening`` decides whether the camera stands. One that stands is averaged by ``still`` (of several, ``rig``).
One that walks goes through ``walk``: ``given`` checks poses that came with it, ``tracking`` registers one
frame after the other (``clouds``, ``checkpoint``), ``places`` joins parts, ``loops`` and ``revisits`` close
loops, ``volume`` makes the map, ``photographs`` colours it. ``errors`` and ``truth`` measure the path.
"""
