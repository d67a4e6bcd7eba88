"""The folder *Plan* of the Network screen: where the room's next cameras stand best, as ghosts to drag."""
