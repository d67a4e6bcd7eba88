"""Bytes, seconds and joules until a delivery's surface is nearly that without losses, by order of tiles."""
