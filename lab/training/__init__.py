"""Training of the depth networks; the only part that needs torch, which PacketMesh itself does not."""
