"""Training of the depth network; the only part that needs torch, which running PacketMesh does not."""
