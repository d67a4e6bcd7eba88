"""Bytes saved between cameras of a rig that see the same surface, and what that costs the mesh."""
