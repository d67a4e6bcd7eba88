"""Recordings of a hand-held depth camera that walks through a rendered room, with their truth."""
