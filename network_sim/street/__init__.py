"""Vehicles with cameras that meet roadside access points, and the schemes that choose what they upload."""
