"""The thesis's claims about the network, computed anew, and how fast that goes."""
