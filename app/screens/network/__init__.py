"""The Network screen: cameras or vehicles that send images, with nodes and packets on one timeline."""
