"""Furniture and objects, by functions ``piece(rng, T_world, ...) -> list[Part]``.

A piece stands on z = 0 of its frame, its front towards -y; ``T_world`` (see ``place``) puts it into the room.
Wall pieces have their back at y = 0. ``rng`` chooses colours and disorder; keywords set fixed properties.
"""
