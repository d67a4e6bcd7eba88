"""PacketMesh: from camera nodes and their packets to a surface mesh."""
